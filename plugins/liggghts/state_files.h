// States of a run on disk: written whole or not at all, the last two kept, and the newest whole one found again.
//
// A state BASE.<step>.restart counts when BASE.<step>.restart.crc beside it names its size and its CRC-32; the mark is written last. It
// also names the grid of processors, which the engine would choose anew by the shape that the box has by then.
#ifndef DEMBARK_STATE_FILES_H
#define DEMBARK_STATE_FILES_H

#include <string>

namespace dembark_liggghts {

struct State {
  long long step = -1;  ///< -1: there is none
  int grid[3] = {0, 0, 0};
};

std::string state_name(const std::string& base, long long step);

/// The newest state that is whole.
State newest_state(const std::string& base);

/// Delete all states, whole or not, but the newest `kept`.
void delete_states(const std::string& base, std::size_t kept);

/// Make the finished file `part` to a state, mark it, and delete all but the last two. Throws std::runtime_error with one line.
void keep_state(const std::string& part, const std::string& base, const State& state);

/// Cut `path` after the last frame (of a dump) or row (of a table that begins with the step) at or before `step`. A file that does not
/// exist is left alone. Throws std::runtime_error with one line.
void cut_output(const std::string& path, long long step);

/// Flush what `path` holds to the disk.
void sync_file(const std::string& path);

}  // namespace dembark_liggghts

#endif
