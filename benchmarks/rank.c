/* Loaded into every rank of an engine, before MPI. Its timers count processor time instead of elapsed time, so that other work on the
 * machine does not enter; with WALL_CLOCK set they stay as they are. At its end a rank writes its peak resident memory (kB) and how many
 * messages and bytes it sent into a file of the folder RANKS. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static double messages, bytes;

double MPI_Wtime(void) {
  struct timespec now;
  clock_gettime(getenv("WALL_CLOCK") ? CLOCK_MONOTONIC : CLOCK_PROCESS_CPUTIME_ID, &now);
  return now.tv_sec + 1e-9 * now.tv_nsec;
}

/* Types and communicators are pointers in Open MPI and numbers in MPICH: as words they pass through unchanged. */
int MPI_Send(const void* from, int count, void* type, int to, int tag, void* world) {
  int size = 0;
  ((int (*)(void*, int*))dlsym(RTLD_NEXT, "MPI_Type_size"))(type, &size);
  messages += 1.0;
  bytes += (double)count * size;
  return ((int (*)(const void*, int, void*, int, int, void*))dlsym(RTLD_NEXT, "MPI_Send"))(from, count, type, to, tag, world);
}

__attribute__((destructor)) static void report(void) {
  char line[4096], *folder = getenv("RANKS");
  /* Launchers and shells have no MPI. */
  if (!folder || !dlsym(RTLD_DEFAULT, "MPI_Init")) return;
  snprintf(line, sizeof line, "%s/rank-%d", folder, (int)getpid());
  FILE *out = fopen(line, "w"), *status = fopen("/proc/self/status", "r");
  while (out && status && fgets(line, sizeof line, status))
    if (!strncmp(line, "VmHWM:", 6)) fprintf(out, "%ld %.0f %.0f\n", atol(line + 6), messages, bytes);
  if (status) fclose(status);
  if (out) fclose(out);
}
