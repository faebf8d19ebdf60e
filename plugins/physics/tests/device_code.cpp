// The laws as CUDA and HIP compile them. test_device_code.py lets clang check this file as device code; physics-tests runs it on the
// processor, where a namespace of its own keeps it apart from the laws as the other files have them.
#if defined(__CUDA__) || defined(__HIP__)
#define CLANG_DEVICE
#define __host__ __attribute__((host))
#define __device__ __attribute__((device))
#define __global__ __attribute__((global))
#else
#define __host__
#define __device__
#define __global__
#endif

#include <array>
#include <cstdlib>
// Behind it, for clang.
#include <algorithm>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

// A device has the functions of these two. Of other headers of the standard library it has what is constexpr: no containers.
#ifdef CLANG_DEVICE
#pragma clang force_cuda_host_device begin
#endif
#include <cmath>
#include <cstring>
#ifdef CLANG_DEVICE
#pragma clang force_cuda_host_device end
#else
#define dembark device_dembark
#endif

#ifndef __HIPCC__
#define __CUDACC__
#endif
#include "every_law.hpp"

#ifdef REFUSED  // by test_device_code.py, to be refused
#include REFUSED
#endif

__global__ void every_law_as_device_code(const void* bridges, double* results) {
#ifdef REFUSED
  results[0] = refused(results[0]);
#endif
  dembark::tests::follow_every_law(static_cast<const dembark::capillary::BridgeForce*>(bridges), results);
}
