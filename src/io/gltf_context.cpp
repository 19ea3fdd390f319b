#include "io/gltf_context.h"

#include <fmt/format.h>

namespace lightcuts::gltf {

void Warnings::add(const std::string& sentence) {
  if (said_.insert(sentence).second) sentences_.push_back(sentence);
}

void Warnings::add_at(const JsonValue& where, const std::string& kind, const std::string& text, std::size_t most) {
  Kind& entry = kinds_[kind];
  entry.most = most;
  if (++entry.count > most) return;
  add(where.locate(text));
  entry.last = sentences_.size() - 1;
}

std::vector<std::string> Warnings::take() {
  for (const auto& [name, kind] : kinds_) {
    if (kind.count > kind.most) sentences_[kind.last] += fmt::format(" ({} more of the kind.)", kind.count - kind.most);
  }
  return std::move(sentences_);
}

void MemoryBudget::charge(std::uint64_t bytes, const JsonValue& where) {
  if (bytes > limit_ - used_) {
    where.fail(fmt::format("the file would unpack to more than {} MiB, far more than its own size suggests. Split the "
                           "scene, or export it with less compression.",
                           limit_ >> 20),
               Code::unsupported);
  }
  used_ += bytes;
}

}  // namespace lightcuts::gltf
