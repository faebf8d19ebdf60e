// LAMMPS's commands write_restart and read_restart, for fixes and commands that read and write such files within a run.
#ifndef DEMBARK_RESTART_COMMANDS_H
#define DEMBARK_RESTART_COMMANDS_H

#include <memory>
#include <string>

#include "command.h"
#include "input.h"

namespace LAMMPS_NS {

/// What is called of LAMMPS's class, whose header no package of LAMMPS holds. Objects are made by LAMMPS.
class WriteRestart : public Command {
 public:
  void command(int, char**) override;
  void multiproc_options(int, int, char**);
  void write(const std::string&);
};

}  // namespace LAMMPS_NS

namespace dembark_lammps {

inline LAMMPS_NS::Command* make_command(LAMMPS_NS::LAMMPS* lmp, const char* name) { return lmp->input->command_map->at(name)(lmp); }

/// Writes the atoms as they are on their ranks. The command would exchange them first. Collective.
inline void write_restart_file(LAMMPS_NS::LAMMPS* lmp, const std::string& path) {
  const std::unique_ptr<LAMMPS_NS::WriteRestart> writer(static_cast<LAMMPS_NS::WriteRestart*>(make_command(lmp, "write_restart")));
  writer->multiproc_options(0, 0, nullptr);
  writer->write(path);
}

inline void read_restart_file(LAMMPS_NS::LAMMPS* lmp, std::string path) {
  const std::unique_ptr<LAMMPS_NS::Command> reader(make_command(lmp, "read_restart"));
  char* words[] = {&path[0]};
  reader->command(1, words);
}

}  // namespace dembark_lammps

#endif
