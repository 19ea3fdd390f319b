#include "io/gltf_accessors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

namespace lightcuts::gltf {
namespace {

/// Elements without bytes behind them may not be more than this: what indices of 32 bits can name.
constexpr std::uint64_t kLargestCount = std::numeric_limits<std::uint32_t>::max();

Component read_component(const JsonValue& owner) {
  const JsonValue member = owner.require("componentType");
  const std::uint64_t number = member.count();
  if ((number < 5120 || number > 5126) || number == 5124) {
    member.fail(fmt::format("{} is no component type; expected 5120 to 5123, 5125 or 5126.", number));
  }
  return static_cast<Component>(number);
}

std::size_t read_width(const JsonValue& accessor) {
  const JsonValue member = accessor.require("type");
  const std::string type = member.string();
  if (type == "SCALAR") return 1;
  if (type == "VEC2") return 2;
  if (type == "VEC3") return 3;
  if (type == "VEC4" || type == "MAT2") return 4;
  if (type == "MAT3") return 9;
  if (type == "MAT4") return 16;
  member.fail(fmt::format("\"{}\" is no accessor type; expected SCALAR, VEC2, VEC3, VEC4 or MAT2 to MAT4.",
                          readable_name(type)));
}

/// Start of `count` elements in a view, `stride` apart; all are checked to lie inside.
const std::byte* first_element(const JsonValue& owner, std::span<const std::byte> bytes, std::uint64_t count,
                               std::uint64_t stride, std::uint64_t element_bytes) {
  const std::uint64_t offset = owner.find("byteOffset").count_or(0);
  const bool fits = count == 0 || (offset <= bytes.size() && element_bytes <= bytes.size() - offset &&
                                   count - 1 <= (bytes.size() - offset - element_bytes) / stride);
  if (!fits) {
    owner.fail(
        fmt::format("{} elements of {} bytes, {} apart from byte {} on, leave their view of {} bytes. Export the "
                    "scene again.",
                    count, element_bytes, stride, offset, bytes.size()));
  }
  return bytes.data() + (count == 0 ? 0 : offset);
}

Accessor read_header(const JsonValue& reference, Context& context) {
  Accessor accessor;
  accessor.where = reference.follow(context.array("accessors"), "an accessor");
  accessor.type = {read_component(accessor.where), read_width(accessor.where)};
  accessor.normalized =
      accessor.where.find("normalized").boolean_or(false) && accessor.type.component != Component::f32;
  accessor.count = accessor.where.require("count").count();
  if (accessor.count > kLargestCount)
    accessor.where.find("count").fail("more elements than indices of 32 bits can name.");
  return accessor;
}

template <class T>
T load(const std::byte* data) {
  T value;  // not aligned for certain: files exist that break the rule, and reading them by bytes is free
  std::memcpy(&value, data, sizeof value);
  return value;
}

template <class T>
float to_float(T value, bool normalized) {
  if constexpr (std::is_same_v<T, float>) {
    return value;
  } else {
    const auto number = static_cast<float>(value);
    if (!normalized) return number;
    return std::max(number / static_cast<float>(std::numeric_limits<T>::max()), -1.0f);
  }
}

/// Calls `body` with a value of the component's type.
template <class Body>
void with_component(Component component, Body&& body) {
  switch (component) {
    case Component::i8:
      return body(std::int8_t{});
    case Component::u8:
      return body(std::uint8_t{});
    case Component::i16:
      return body(std::int16_t{});
    case Component::u16:
      return body(std::uint16_t{});
    case Component::u32:
      return body(std::uint32_t{});
    case Component::f32:
      return body(float{});
  }
}

template <class T>
void convert_element(const std::byte* data, const Accessor& accessor, float* out) {
  for (std::size_t c = 0; c < accessor.type.width; ++c) {
    out[c] = to_float(load<T>(data + c * sizeof(T)), accessor.normalized);
  }
}

template <class T>
void convert(const Accessor& accessor, std::span<const std::uint32_t> subset, float* out) {
  const std::size_t count = subset.empty() ? accessor.count : subset.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t element = subset.empty() ? i : subset[i];
    convert_element<T>(accessor.data + element * accessor.stride, accessor, out + i * accessor.type.width);
  }
}

/// Replaces the sparse elements among those that were read.
void apply_sparse(const Accessor& accessor, std::span<const std::uint32_t> subset, float* out) {
  const auto& indices = accessor.sparse.indices;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    std::size_t slot = indices[i];
    if (!subset.empty()) {
      const auto found = std::lower_bound(subset.begin(), subset.end(), indices[i]);
      if (found == subset.end() || *found != indices[i]) continue;
      slot = static_cast<std::size_t>(found - subset.begin());
    }
    const std::byte* value = accessor.sparse.values + i * accessor.type.byte_count();
    with_component(accessor.type.component, [&](auto type) {
      convert_element<decltype(type)>(value, accessor, out + slot * accessor.type.width);
    });
  }
}

template <class T>
void widen(const std::byte* data, std::size_t stride, std::size_t count, std::uint32_t* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<std::uint32_t>(load<T>(data + i * stride));
}

void widen(Component component, const std::byte* data, std::size_t stride, std::size_t count, std::uint32_t* out) {
  switch (component) {
    case Component::u8:
      return widen<std::uint8_t>(data, stride, count, out);
    case Component::u16:
      return widen<std::uint16_t>(data, stride, count, out);
    default:
      return widen<std::uint32_t>(data, stride, count, out);
  }
}

bool is_index_type(Component component) {
  return component == Component::u8 || component == Component::u16 || component == Component::u32;
}

void open_sparse(Accessor& accessor, const JsonValue& sparse, Context& context, Buffers& buffers) {
  const std::uint64_t count = sparse.require("count").count();
  if (count > accessor.count)
    sparse.find("count").fail(fmt::format("more than the accessor's {} elements.", accessor.count));
  const JsonValue indices = sparse.require("indices");
  const Component type = read_component(indices);
  if (!is_index_type(type)) indices.find("componentType").fail("expected an unsigned integer type.");
  const View index_view = buffers.view(indices.require("bufferView"));
  const std::byte* first = first_element(indices, index_view.bytes, count, size_of(type), size_of(type));
  context.budget.charge(count * sizeof(std::uint32_t), sparse);
  accessor.sparse.indices.resize(count);
  widen(type, first, size_of(type), count, accessor.sparse.indices.data());
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t index = accessor.sparse.indices[i];
    if (index >= accessor.count || (i > 0 && index <= accessor.sparse.indices[i - 1])) {
      indices.fail(
          fmt::format("index {} at position {}: expected increasing indices below {}.", index, i, accessor.count));
    }
  }
  const JsonValue values = sparse.require("values");
  const View value_view = buffers.view(values.require("bufferView"));
  accessor.sparse.values =
      first_element(values, value_view.bytes, count, accessor.type.byte_count(), accessor.type.byte_count());
}

}  // namespace

std::size_t size_of(Component component) {
  switch (component) {
    case Component::i8:
    case Component::u8:
      return 1;
    case Component::i16:
    case Component::u16:
      return 2;
    default:
      return 4;
  }
}

ElementType read_element_type(const JsonValue& reference, Context& context) {
  const JsonValue accessor = reference.follow(context.array("accessors"), "an accessor");
  return {read_component(accessor), read_width(accessor)};
}

Accessor open_accessor(const JsonValue& reference, Context& context, Buffers& buffers) {
  Accessor accessor = read_header(reference, context);
  const JsonValue view_index = accessor.where.find("bufferView");
  if (view_index) {
    const View view = buffers.view(view_index);
    accessor.stride = view.stride != 0 ? view.stride : accessor.type.byte_count();
    if (accessor.stride < accessor.type.byte_count()) {
      accessor.where.fail(fmt::format("the view's byteStride {} is smaller than an element of {} bytes.",
                                      accessor.stride, accessor.type.byte_count()));
    }
    accessor.data =
        first_element(accessor.where, view.bytes, accessor.count, accessor.stride, accessor.type.byte_count());
  }
  if (const JsonValue sparse = accessor.where.find("sparse")) open_sparse(accessor, sparse, context, buffers);
  return accessor;
}

Accessor open_accessor_on(const JsonValue& reference, Context& context, std::span<const std::byte> data) {
  Accessor accessor = read_header(reference, context);
  accessor.stride = accessor.type.byte_count();
  if (accessor.count > data.size() / accessor.stride) {
    accessor.where.fail(fmt::format("{} elements of {} bytes announced, {} bytes decompressed.", accessor.count,
                                    accessor.stride, data.size()));
  }
  accessor.data = data.data();
  return accessor;
}

void read_floats(const Accessor& accessor, std::span<const std::uint32_t> subset, float* out) {
  const std::size_t count = subset.empty() ? accessor.count : subset.size();
  const std::size_t bytes = count * accessor.type.width * sizeof(float);
  if (count == 0) return;
  if (accessor.data == nullptr) {
    std::memset(out, 0, bytes);
  } else if (accessor.type.component == Component::f32 && accessor.stride == accessor.type.byte_count() &&
             subset.empty()) {
    std::memcpy(out, accessor.data, bytes);
  } else {
    with_component(accessor.type.component, [&](auto type) { convert<decltype(type)>(accessor, subset, out); });
  }
  apply_sparse(accessor, subset, out);
}

void read_indices(const Accessor& accessor, std::size_t limit, std::uint32_t* out) {
  if (!is_index_type(accessor.type.component) || accessor.type.width != 1) {
    accessor.where.fail("expected SCALAR elements of an unsigned integer type, to be used as indices.");
  }
  const std::size_t count = std::min(limit, accessor.count);
  if (count == 0) return;
  if (accessor.data == nullptr) {
    std::fill_n(out, count, 0u);
  } else if (accessor.type.component == Component::u32 && accessor.stride == sizeof(std::uint32_t)) {
    std::memcpy(out, accessor.data, count * sizeof(std::uint32_t));
  } else {
    widen(accessor.type.component, accessor.data, accessor.stride, count, out);
  }
  for (std::size_t i = 0; i < accessor.sparse.indices.size() && accessor.sparse.indices[i] < count; ++i) {
    widen(accessor.type.component, accessor.sparse.values + i * size_of(accessor.type.component), 0, 1,
          out + accessor.sparse.indices[i]);
  }
}

}  // namespace lightcuts::gltf
