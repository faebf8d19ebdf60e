"""Files of grains and contacts as frames of numbers: text and binary dumps of LAMMPS's format, plain or gzipped, and VTK files."""
