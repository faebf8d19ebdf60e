#pragma once
// Catch2 as Debian 12 (version 2, one header) and Debian 13 (version 3, a library) have it, under the names of version 2.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>

namespace Catch {
using Matchers::WithinAbs;
using Matchers::WithinRel;
inline auto Contains(const std::string& text) { return Matchers::ContainsSubstring(text); }
}  // namespace Catch
using Catch::Approx;
#else
#include <catch2/catch.hpp>
#endif
