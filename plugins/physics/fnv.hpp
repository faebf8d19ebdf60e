// Hash of integers or characters (FNV-1a, 64 bit), one word after the other.
#pragma once

#include <cstdint>
#include <type_traits>

namespace dembark {

constexpr std::uint64_t fnv1a_start = 1469598103934665603u;
constexpr std::uint64_t fnv1a_next(std::uint64_t hash, std::uint64_t word) { return (hash ^ word) * 1099511628211u; }

template <class List>
std::uint64_t fnv1a(const List& numbers) {
  std::uint64_t hash = fnv1a_start;
  for (const auto number : numbers) hash = fnv1a_next(hash, std::make_unsigned_t<typename List::value_type>(number));
  return hash;
}

}  // namespace dembark
