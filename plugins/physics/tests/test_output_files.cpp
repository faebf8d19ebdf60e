// Output files that a run which goes on from a state cuts: behind the step of the state, by their length or their format, and never else.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <unistd.h>

#include "catch.hpp"
#include "dembark/restart/state_files.hpp"

namespace {

using namespace dembark::restart;

struct Folder {
  fs::path path = fs::temp_directory_path() / ("dembark-output-" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name, std::ios::binary) << text;
    return (path / name).string();
  }
  std::string read(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(path / name, std::ios::binary).rdbuf();
    return text.str();
  }
  std::size_t files() const { return std::size_t(std::distance(fs::directory_iterator(path), fs::directory_iterator())); }
};

struct Format {
  const char *name, *titles, *kept, *behind;
};

const char* const custom = "ITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS pp pp ff\n0 1\n0 1\n0 1\nITEM: ATOMS id x\n1 0.5\n2 0.7\n";

std::string frame(const std::string& head, const std::string& step, const std::string& rest = custom) {
  return head + "ITEM: TIMESTEP\n" + step + "\n" + rest;
}

/// `kept` is of the steps up to 400, `behind` of later ones.
std::vector<std::array<std::string, 4>> formats_of_engines() {
  const std::string local = "ITEM: NUMBER OF ENTRIES\n2\nITEM: BOX BOUNDS pp pp ff\n0 1\n0 1\n0 1\nITEM: ENTRIES c_1\n1\n2\n";
  const std::string grid =
      "ITEM: BOX BOUNDS pp pp ff\n0 1\n0 1\n0 1\nITEM: DIMENSION\n2\nITEM: GRID SIZE nx ny nz\n2 1 1\nITEM: GRID CELLS f\n1\n2\n";
  const std::string none = "ITEM: NUMBER OF ENTRIES\n0\nITEM: BOX BOUNDS pp pp ff\n0 1\n0 1\n0 1\nITEM: ENTRIES c_1\n";
  const auto block = [](const std::string& step) { return step + " 3\n1 0.5\n2 7\n3 nan\n"; };
  const auto chunk = [](const std::string& step) { return step + " 2 48\n  7 0.1 20 1e5\n  9 0.2 28 2e5\n"; };
  const auto histo = [](const std::string& step) { return step + " 2 48 0 -1 1\n1 -0.5 20 0.4\n2 0.5 28 0.6\n"; };
  const auto xyz = [](const std::string& step) { return "2\n Atoms. Timestep: " + step + " Time: 0.1\n1 0 0 0\n1 1 1 1\n"; };
  const auto yaml = [](const std::string& step) {
    return "---\ncreator: LAMMPS\ntimestep: " + step + "\nnatoms: 1\nkeywords: [ id, x, ]\ndata:\n  - [ 1 , 0.5, ]\n...\n";
  };
  const auto vector = [](const std::string& step) { return "  " + step + ":\n  - [0, ]\n  - [1.5, ]\n"; };
  const auto across = [](const std::string& step) { return "# Timestep: " + step + "\n0 1e39 \n1e-05 2e39 \n"; };
  return {
      {"dump custom", "", frame("", "0") + frame("", "400"), frame("", "500") + frame("", "600")},
      {"dump, units and time", "", frame("ITEM: UNITS\nsi\nITEM: TIME\n0\n", "0") + frame("ITEM: TIME\n0.4\n", "400"),
       frame("ITEM: TIME\n0.5\n", "500") + frame("ITEM: TIME\n0.6\n", "600")},
      {"dump local with a label", "", frame("", "0\nITEM: LABEL\nwall", local) + frame("", "200\nITEM: LABEL\nwall", none),
       frame("", "401\nITEM: LABEL\nwall", none)},
      {"dump grid", "", frame("", "400", grid), frame("", "500", grid)},
      {"dump xyz", "", xyz("0") + xyz("400"), xyz("500")},
      {"dump yaml", "", yaml("0") + yaml("400"), yaml("500") + yaml("600")},
      {"ave/time", "# Time-averaged data for fix m\n# TimeStep c_t c_p\n", "100 1.5 3\n200 1e20 4\n400 nan 4\n", "500 1 2\n600 1 2\n"},
      {"ave/time, titles without #", "my table\nn a\n", "100 1.5\n200 2\n300 7\n400 7\n", "500 1\n600 1\n"},
      {"ave/time, titles with #", "# my table\n# n a\n", "200 1.5\n400 2\n", "600 1\n"},
      {"ave/time of vectors", "# Time-averaged data for fix m\n# TimeStep Number-of-rows\n# Row c_p\n", block("100") + block("400"),
       block("500") + block("600")},
      {"ave/time of vectors, titles without #", "a\nb c\nd\n", block("100") + block("400"), block("500")},
      {"ave/chunk", "# Chunk\n# Timestep Number-of-chunks Total-count\n# Chunk Coord1 Ncount vx\n", chunk("0") + chunk("400"),
       chunk("500")},
      {"ave/histo", "# H\n# TimeStep Number-of-bins Total\n# Bin Coord Count Count/Total\n", histo("400"), histo("500") + histo("600")},
      {"ave/correlate", "# C\n# Timestep Number-of-time-windows\n# Index TimeDelta Ncount c\n",
       "0 2\n1 0 1 0\n2 1 0 0.0\n400 2\n1 0 21 3e39\n2 1 20 1e3\n", "500 2\n1 0 1 0\n2 1 0 0.0\n"},
      {"ave/correlate/long", "# Time-correlated data for fix a6\n# Time c*c\n", across("0") + across("400"), across("500")},
      {"ave/time in yaml", "# Time-averaged\n# TimeStep c_t\n---\nkeywords: ['Step', 'c_t', ]\ndata:\n",
       "  - [200, 1.5, ]\n  - [400, 4.5, ]\n", "  - [600, 1, ]\n...\n"},
      {"ave/time of vectors in yaml", "# T\n---\nkeywords: ['c_p', ]\ndata:\n", vector("200") + vector("400"), vector("600") + "...\n"},
      {"fix print with a title", "step,kinetic_energy\n", "0,1\n50,2\n399,7\n", "401,1\n"},
      {"fix print", "# Fix print output for fix p\n", "200 1\n400 2\n", "600 3\n"},
  };
}

}  // namespace

TEST_CASE("every format is cut behind the step of the state only") {
  const Folder folder;
  for (const auto& [name, titles, kept, behind] : formats_of_engines()) {
    CAPTURE(name);
    const std::string path = folder.write("out", titles + kept + behind);
    CHECK(cut_output(path, 400) == "file " + path + " is cut behind step 400; what was cut off is in " + path + ".after-400");
    CHECK(folder.read("out") == titles + kept);
    CHECK(folder.read("out.after-400") == behind);
    CHECK(cut_output(path, 400).empty());
    fs::remove(path + ".after-400");
    // A run that appends writes its titles once more, and is killed while it writes.
    folder.write("out", titles + kept + titles + behind.substr(0, behind.size() - 3));
    cut_output(path, 400);
    CHECK(folder.read("out").substr(0, titles.size() + kept.size()) == titles + kept);
    CHECK(folder.read("out").size() <= 2 * titles.size() + kept.size());
    fs::remove(path + ".after-400");
    CHECK(folder.files() == 1);
  }
}

TEST_CASE("a last row or frame that is not complete is cut off") {
  const Folder folder;
  for (const auto& [name, titles, kept, behind] : formats_of_engines()) {
    CAPTURE(name);
    const std::string path = folder.write("out", titles + kept + behind.substr(0, 4));
    cut_output(path, 1000);
    CHECK(folder.read("out") == titles + kept);
  }
}

TEST_CASE("a file whose steps are not understood is left as it is") {
  const Folder folder;
  const std::string cases[] = {
      "# Fix print output for fix p\n0.1 5\n0.2 6\n0.3 7\n",              // times
      "# Fix print output for fix p\n585 5\n600 6\n715 7\n",              // numbers of grains
      "# Fix print output for fix p\n585\n715\n",                         //
      "# Fix print output for fix p\n715\n",                              //
      "x 20 y\nx 400 y\nx 600 y\n",                                       // words
      "step x\n0 1\n500 2\n0 1\n500 2\n",                                 // of two runs
      "step x\n0 1\n500 2 3\n",                                           //
      "Step Temp\n0 1\n500 2\nLoop time of 0.1\n",                        // a log
      "id_a id_b time\n1 2 0.5\n1 3 0.6\n",                               // impacts
      "# a b c\n0 3\n1 0.5\n2 0.7\n3 0.9\n",                              // rows, or one block: a table of steps 0 to 3?
      "solid wall\nfacet normal 0 0 1\nendsolid wall\n",                  //
      "# vtk DataFile Version 2.0\nPOINTS 3 float\n1 2 3\n",              //
      std::string("\xf6\xff\xff\xff\0\0DUMPCUSTOM\n500 1\n600 1\n", 30),  // a binary dump
      "\x1f\x8b\x08 packed\n",                                            //
      "\x28\xb5\x2f\xfd packed\n",                                        //
      "ITEM: TIMESTEP\nnever\nITEM: NUMBER OF ATOMS\n0\n",                //
      frame("", "500") + frame("", "0"),                                  //
      "500",                                                              // no line
  };
  for (const std::string& text : cases) {
    CAPTURE(text);
    const std::string path = folder.write("out", text);
    CHECK_THAT(cut_output(path, 2), Catch::Contains("is left as it is"));
    CHECK(folder.read("out") == text);
    CHECK(folder.files() == 1);
  }
  CHECK(cut_output((folder.path / "nothing").string(), 2).empty());
}

TEST_CASE("a file is cut to its length in the state whatever it holds") {
  const Folder folder;
  const std::string before = std::string("x 20 y\n\0 42\n", 12), path = folder.write("out", before);
  const std::vector<OutputFile> files = output_files({path, (folder.path / "nothing").string()});
  REQUIRE(files.size() == 1);
  folder.write("out", before + "x 40 y\n# title\nhalf a li");
  CHECK(cut_output(files[0], 400, false).empty());
  CHECK(folder.read("out") == before);
  CHECK(folder.files() == 1);

  folder.write("out", before + "x 40 y\n");
  CHECK_THAT(cut_output(files[0], 400, true), Catch::Contains("what was cut off is in"));
  CHECK(folder.read("out.after-400") == "x 40 y\n");
  folder.write("out", before + "x 41 y\n");
  cut_output(files[0], 400, true);
  CHECK(folder.read("out.after-400") == "x 40 y\n");
  CHECK(folder.read("out.after-400.2") == "x 41 y\n");

  folder.write("out", "short");
  CHECK_THAT(cut_output(files[0], 400, false), Catch::Contains("it has 5 bytes, and had 12 at step 400"));
  folder.write("out", "another file that is longer");
  CHECK_THAT(cut_output(files[0], 400, false), Catch::Contains("another one than at step 400"));
  CHECK(folder.read("out") == "another file that is longer");
  fs::remove(path);
  CHECK_THAT(cut_output(files[0], 400, false), Catch::Contains("is gone"));
}

TEST_CASE("a file that the engines write anew keeps what it has under another name") {
  const Folder folder;
  CHECK(keep_unappendable(folder.write("a.dump", "text"), {}, 400).empty());
  const std::string path = folder.write("a.bin", "frames");
  const std::vector<OutputFile> files = output_files({path});
  folder.write("a.bin", "frames and more");
  CHECK_THAT(keep_unappendable(path, files, 400), Catch::Contains("is in " + path + ".until-400"));
  CHECK(folder.read("a.bin.until-400") == "frames");
  CHECK(!fs::exists(path));
  CHECK(keep_unappendable(path, files, 400).empty());
  folder.write("a.bin", "others");
  keep_unappendable(path, files, 400);
  CHECK(folder.read("a.bin.until-400.2") == "others");
}
