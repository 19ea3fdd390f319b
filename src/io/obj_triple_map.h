#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

namespace lightcuts::obj {

/// Numbers triples of integers in the order of their first appearance.
///
/// An open-addressing hash whose function is drawn at random for each table, so that no file can be made to collide;
/// the numbers do not depend on it.
class TripleMap {
 public:
  using Triple = std::array<std::uint32_t, 3>;

  TripleMap() : slots_(kFirstSize, kFree) {
    std::random_device random;
    for (std::uint64_t& key : keys_of_hash_) key = (std::uint64_t{random()} << 32 | random()) | 1;
  }

  /// The number of `triple`: triples().size() before the call if it is new.
  std::uint32_t insert(const Triple& triple) {
    if (2 * triples_.size() >= slots_.size()) grow();
    std::size_t slot = hash(triple) & (slots_.size() - 1);
    while (slots_[slot] != kFree) {
      if (triples_[slots_[slot]] == triple) return slots_[slot];
      slot = (slot + 1) & (slots_.size() - 1);
    }
    slots_[slot] = static_cast<std::uint32_t>(triples_.size());
    triples_.push_back(triple);
    return slots_[slot];
  }

  [[nodiscard]] const std::vector<Triple>& triples() const { return triples_; }

 private:
  static constexpr std::size_t kFirstSize = 64;
  static constexpr std::uint32_t kFree = 0xffffffffu;

  /// Multiply, fold, multiply: each step with a secret factor.
  [[nodiscard]] std::size_t hash(const Triple& triple) const {
    std::uint64_t h = (std::uint64_t{triple[0]} << 32 | triple[1]) ^ keys_of_hash_[0];
    h *= keys_of_hash_[1];
    h = (h ^ (h >> 32) ^ triple[2]) * keys_of_hash_[2];
    h = (h ^ (h >> 29)) * keys_of_hash_[1];
    return static_cast<std::size_t>(h ^ (h >> 32));
  }

  void grow() {
    slots_.assign(2 * slots_.size(), kFree);
    for (std::uint32_t i = 0; i < triples_.size(); ++i) {
      std::size_t slot = hash(triples_[i]) & (slots_.size() - 1);
      while (slots_[slot] != kFree) slot = (slot + 1) & (slots_.size() - 1);
      slots_[slot] = i;
    }
  }

  std::array<std::uint64_t, 3> keys_of_hash_{};
  std::vector<std::uint32_t> slots_;  ///< numbers of triples; the count of slots is a power of two
  std::vector<Triple> triples_;
};

}  // namespace lightcuts::obj
