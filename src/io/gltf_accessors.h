#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/gltf_buffers.h"

namespace lightcuts::gltf {

/// glTF's numbers for the types of a component.
enum class Component : std::uint16_t { i8 = 5120, u8 = 5121, i16 = 5122, u16 = 5123, u32 = 5125, f32 = 5126 };

/// Bytes of one component.
std::size_t size_of(Component component);

/// What an accessor's elements are made of.
struct ElementType {
  Component component = Component::f32;
  std::size_t width = 1;  ///< components of an element

  [[nodiscard]] std::size_t byte_count() const { return size_of(component) * width; }
};

/// The type that the accessor of index `reference` declares.
ElementType read_element_type(const JsonValue& reference, Context& context);

/// An accessor all of whose elements are known to lie inside their buffers.
struct Accessor {
  JsonValue where;
  std::size_t count = 0;
  ElementType type;
  bool normalized = false;
  const std::byte* data = nullptr;  ///< null: all zeros
  std::size_t stride = 0;           ///< from element to element [bytes]

  /// Elements that replace those of `data`.
  struct Sparse {
    std::vector<std::uint32_t> indices;  ///< strictly increasing, each below count
    const std::byte* values = nullptr;   ///< packed
  } sparse;
};

/// Opens the accessor whose index is `reference` and checks its counts, offsets and strides against the bytes there are.
Accessor open_accessor(const JsonValue& reference, Context& context, Buffers& buffers);

/// The same, but the elements lie packed in `data` (made by a decompressor), which must outlive the result.
Accessor open_accessor_on(const JsonValue& reference, Context& context, std::span<const std::byte> data);

/// Reads elements as floats, normalised integers scaled to [-1, 1] or [0, 1].
///
/// @param subset  which elements, ascending; empty: all
/// @param out     as many elements of `accessor.type.width` floats each, packed
void read_floats(const Accessor& accessor, std::span<const std::uint32_t> subset, float* out);

/// Reads an accessor of unsigned integers. `out` holds `limit` numbers: the first ones of the accessor.
void read_indices(const Accessor& accessor, std::size_t limit, std::uint32_t* out);

}  // namespace lightcuts::gltf
