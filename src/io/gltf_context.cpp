#include "io/gltf_context.h"

#include <fmt/format.h>

namespace lightcuts::gltf {

void MemoryBudget::charge(std::uint64_t bytes, const JsonValue& where) {
  if (bytes > limit_ - used_) {
    where.fail(fmt::format("the file would unpack to more than {} MiB, far more than its own size suggests. Split the "
                           "scene, or export it with less compression.",
                           limit_ >> 20),
               Code::out_of_memory);
  }
  used_ += bytes;
}

}  // namespace lightcuts::gltf
