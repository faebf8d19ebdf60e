// Hash of integers or characters (FNV-1a, 64 bit).
#pragma once

#include <cstdint>
#include <type_traits>

namespace dembark {

template <class List>
std::uint64_t fnv1a(const List& numbers) {
  std::uint64_t hash = 1469598103934665603u;
  for (const auto number : numbers) hash = (hash ^ std::make_unsigned_t<typename List::value_type>(number)) * 1099511628211u;
  return hash;
}

}  // namespace dembark
