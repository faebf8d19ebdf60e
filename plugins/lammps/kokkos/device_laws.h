// The parameters of all pairs of types, and the tables of their bridges, where a device reads them.
#ifndef DEMBARK_DEVICE_LAWS_H
#define DEMBARK_DEVICE_LAWS_H

#include <cstddef>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include <Kokkos_Core.hpp>

#include "dembark/contact.hpp"

namespace dembark_lammps {

template <class DeviceType>
class DeviceLaws {
  typedef dembark::ContactParameters Parameters;
  typedef dembark::capillary::BridgeForce BridgeForce;
  typedef Kokkos::View<unsigned char*, Kokkos::LayoutRight, DeviceType> Bytes;
  static_assert(std::is_trivially_copyable_v<Parameters> && std::is_trivially_copyable_v<BridgeForce>);

  std::vector<Bytes> arrays_;
  Bytes parameters_;
  int row_ = 0;

  /// `values` on the device; they live as long as this object.
  template <class Value>
  const Value* copy(const Value* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<Value>);
    if (!values) return nullptr;
    const std::size_t size = count * sizeof(Value);
    const Bytes there(Kokkos::view_alloc(std::string("dembark:law"), Kokkos::WithoutInitializing), size);
    const Kokkos::View<const unsigned char*, Kokkos::LayoutRight, Kokkos::HostSpace, Kokkos::MemoryTraits<Kokkos::Unmanaged>> here(
        reinterpret_cast<const unsigned char*>(values), size);
    Kokkos::deep_copy(there, here);
    arrays_.push_back(there);
    return reinterpret_cast<const Value*>(there.data());
  }

  const BridgeForce* copy(const BridgeForce& law) {
    BridgeForce there = law;
    const auto table = [this](auto& of) {
      of.rows = copy(of.rows, of.row_count);
      of.patches = copy(of.patches, of.patch_count);
    };
    table(there.tables.equal);
    table(there.tables.unequal);
    return copy(&there, 1);
  }

 public:
  /// `law(i, j)`: the parameters of types i and j, which go from 1 to `types`.
  template <class Law>
  void assign(int types, Law law) {
    arrays_.clear();
    row_ = types + 1;
    std::vector<Parameters> all(std::size_t(row_) * row_);
    std::map<const BridgeForce*, const BridgeForce*> bridges;
    for (int i = 1; i <= types; ++i)
      for (int j = 1; j <= types; ++j) {
        Parameters& p = all[std::size_t(i * row_ + j)] = law(i, j);
        const BridgeForce*& force = p.cohesion.liquid.force;
        if (!force) continue;
        const BridgeForce*& there = bridges[force];
        if (!there) there = copy(*force);
        force = there;
      }
    copy(all.data(), all.size());
    parameters_ = arrays_.back();
  }

  /// What a kernel takes along: without the list of arrays, which is for the processor.
  class Reader {
    Bytes parameters_;
    int row_ = 0;

   public:
    Reader() = default;
    Reader(Bytes parameters, int row) : parameters_(parameters), row_(row) {}
    KOKKOS_INLINE_FUNCTION const Parameters& operator()(int i, int j) const {
      return reinterpret_cast<const Parameters*>(parameters_.data())[i * row_ + j];
    }
  };
  Reader reader() const { return {parameters_, row_}; }
};

}  // namespace dembark_lammps

#endif
