#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace lightcuts::app::frame {

/// What --part leaves of `bench frame`: scenes, numbers of lights, and stages by parts of their names. A measurement is
/// wanted if it is in each of the three that are named at all.
class Parts {
 public:
  /// Throws Error{invalid_argument} if a word is neither a scene nor a number nor in any stage's name.
  explicit Parts(const std::vector<std::string>& words);

  [[nodiscard]] bool wants_scene(const std::string& name) const;
  [[nodiscard]] bool wants_lights(std::uint64_t vpls) const;
  /// Throws Error{internal} for a stage that is not in the list of all stages, so that the list stays complete.
  [[nodiscard]] bool wants_stage(const std::string& stage) const;
  [[nodiscard]] bool wants_any_stage(const std::vector<std::string>& stages) const;

  /// The numbers of lights that are named; empty: all are wanted.
  [[nodiscard]] const std::vector<std::uint64_t>& numbers() const noexcept { return numbers_; }

 private:
  std::vector<std::string> scenes_, stages_;
  std::vector<std::uint64_t> numbers_;
};

}  // namespace lightcuts::app::frame
