"""Files of grains and contacts as frames of numbers: text dumps and binary dumps, plain or gzipped, and VTK files."""
