// What LAMMPS's plugin loader and a plugin say to each other (LAMMPS manual, "Writing plugins"); packages of LAMMPS hold no header of it.
#ifndef DEMBARK_LAMMPS_PLUGIN_H
#define DEMBARK_LAMMPS_PLUGIN_H

extern "C" {
typedef void*(PairCreator)(void* lammps);
typedef void*(FixCreator)(void* lammps, int narg, char** arg);
typedef void*(CommandCreator)(void* lammps);

typedef struct {
  const char *version, *style, *name, *info, *author;
  union {
    PairCreator* pair;
    FixCreator* fix;
    CommandCreator* command;
  } creator;
  void* handle;
} PluginStyle;

typedef void (*RegisterStyle)(PluginStyle*, void* lammps);

void lammpsplugin_init(void* lammps, void* handle, void* register_style);
}

#endif
