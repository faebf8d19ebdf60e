// States of a run on disk: written whole or not at all, the last two kept, and the newest whole one found again.
//
// A state BASE.<step>.restart counts when BASE.<step>.restart.crc beside it names its size and its CRC-32; the mark is written last. It
// also names the grid of processors, which the engine would choose anew by the shape that the box has by then.
#ifndef DEMBARK_STATE_FILES_H
#define DEMBARK_STATE_FILES_H

#include <string>
#include <vector>

namespace dembark_liggghts {

/// Steps of the states `base`.<step>.restart that are whole, the newest first.
std::vector<long long> whole_states(const std::string& base);

std::string state_name(const std::string& base, long long step);

/// The grid of processors of the run that wrote a state; false when the state has no mark.
bool processor_grid(const std::string& state, int (&grid)[3]);

/// Make the finished file `part` to the state of `step`, mark it, and delete all but the last two. What went wrong, or nothing.
std::string keep_state(const std::string& part, const std::string& base, long long step, const int (&grid)[3]);

/// Delete the states that are not whole.
void delete_broken_states(const std::string& base);

/// The state that this process reads, for the fixes that are made afterwards; `state_that_was_read` is the one of `step` at `base` when
/// none was named.
void name_state_that_is_read(const std::string& path);
std::string state_that_was_read(const std::string& base, long long step);

/// The line about a file that ends too early.
std::string not_whole(const std::string& path);

/// Cut `path` after the last frame (of a dump) or row (of a table that begins with the step) at or before `step`. What went wrong, or
/// nothing. A file that does not exist is left alone.
std::string cut_output(const std::string& path, long long step);

/// Flush what `path` holds to the disk.
void sync_file(const std::string& path);

}  // namespace dembark_liggghts

#endif
