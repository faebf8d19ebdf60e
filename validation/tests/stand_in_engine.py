#!/usr/bin/python3
"""Stands in for both engines where a test is about the handling of processes and files, not about physics.

Called like LIGGGHTS (`-in deck -log none -var key value ...`) or YADE (`-j1 -n -x deck key=value ...`); it reads its numbers in the deck
and obeys the deck contract unless the parameter `behaviour` names a fault. It writes its process id to `pid` in the working folder
first.
"""

import os
import pathlib
import re
import signal
import sys
import time
import zlib

words = sys.argv[1:]
if "--version" in words:
    print("Yade version: 2025.2.0-stand-in")
    sys.exit(0)
print("LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0-stand-in, compiled 2022)")
if "/dev/null" in words:
    sys.exit(0)
if "-in" in words:
    with pathlib.Path(words[words.index("-in") + 1]).open(encoding="utf-8") as file:
        given = (re.split(" (?:string|index) ", line) for line in file if line.startswith("variable "))
        values = {name.split()[1]: text.split(" # ")[0].strip() for name, text in given}
    values |= {words[i + 1]: words[i + 2] for i, word in enumerate(words) if word == "-var"}
else:
    with pathlib.Path(words[words.index("-x") + 1]).open(encoding="utf-8") as file:
        numbers = [line.split("  # ")[0].strip().rstrip(",").split("=", 1) for line in file if line.startswith("    ")]
    values = {key: text.strip("'") for key, text in numbers if text != "None"}
    values |= dict(word.split("=", 1) for word in words if "=" in word)
behaviour, frames, grains = values["behaviour"], int(values["frames"]), int(values["grain_count"])
with pathlib.Path("pid").open("w", encoding="utf-8") as file:
    file.write(str(os.getpid()))
with pathlib.Path("values").open("w", encoding="utf-8") as file:
    file.write("\n".join(f"{key}={value}" for key, value in sorted(values.items())))
with pathlib.Path("tmpdir").open("w", encoding="utf-8") as file:
    file.write(os.environ.get("TMPDIR", ""))
every, begin = int(values.get("restart_every", 0)), 0
suffix = "restart" if "-in" in words else "yade.gz"
if values.get("resume") == "yes":
    begin = max(int(path.name.split(".")[1]) for path in pathlib.Path().glob(f"state.*.{suffix}") if pathlib.Path(f"{path}.crc").exists())
print("dembark: steps 100 time_step 1e-5", flush=True)
if begin:
    print(f"dembark: resumed at step {begin} {behaviour.removeprefix('kill ') if behaviour.startswith('kill ') else 'exact'}ly", flush=True)
    behaviour = {"kill": "ok", "kill approximate": "ok", "hang": "ok", "full": "ok"}.get(behaviour, behaviour)
for step in range(begin, 101, 10):
    if every and step > begin and step % every == 0:
        name = f"state.{step}.{suffix}"
        with pathlib.Path(name).open("wb") as file:
            file.write(b"state" * step)
        with pathlib.Path(name + ".crc").open("w", encoding="utf-8") as file:
            file.write(f"{5 * step} {zlib.crc32(b'state' * step):08x} 1 1 1\n")
    print(f"      {step}  {step * 1e-5}  0.5", flush=True)
    time.sleep(float(values.get("pause", 0)))
    if step == 50:
        if behaviour == "exit":
            print("ERROR: Lost atoms: original 10 current 9 (thermo.cpp:389)")
            sys.exit(1)
        if behaviour in ("abort", "abort by signal"):
            # As with several ranks: the words of the one at fault lie within a line of another, which the launcher then ends by a signal.
            print("      6ERROR on proc 1: atoms 3 and 4 have the same centre (pair.cpp:9)\n0 0.6\n"
                  "SIGINT/SIGTERM caught - Writing restart on next occasion and quitting after that.\n"
                  "MPI_ABORT was invoked on rank 1 in communicator MPI_COMM_WORLD")
            sys.exit(1 if behaviour == "abort" else 143)
        if behaviour in ("kill", "kill approximate"):
            os.kill(os.getpid(), signal.SIGKILL)
        if behaviour == "hang":
            time.sleep(600)
        if behaviour == "full":
            print("OSError: [Errno 28] No space left on device: 'grains.dump'")
            sys.exit(1)


def dump(name, key, columns, entries):
    box = "ITEM: BOX BOUNDS ff ff ff\n" + "0 1\n" * 3
    text = "".join(f"ITEM: TIMESTEP\n{frame}\nITEM: NUMBER OF {key}\n{entries}\n{box}ITEM: {columns}\n" + "1 2 3\n" * entries
                   for frame in range(frames))
    with pathlib.Path(name).open("w", encoding="utf-8") as file:
        file.write(text[: {"truncate": -len(text) // 2, "short": -len(text) // frames}.get(behaviour, len(text))])


dump("grains.dump", "ATOMS", "ATOMS id x y", grains)
dump("contacts.dump", "ENTRIES", "ENTRIES a b c", 0 if grains < 4 else 4)
with pathlib.Path("time.csv").open("w", encoding="utf-8") as file:
    energy = "nan" if behaviour == "unstable" else "0.5"
    file.write("step,time,kinetic_energy\n0,0,1\n" + f"100,1e-3,{energy}\n")
if behaviour == "silent":
    sys.exit(0)
print("dembark: finished")
