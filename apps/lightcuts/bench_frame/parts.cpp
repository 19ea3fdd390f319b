#include "bench_frame/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "lightcuts/error.h"
#include "text.h"
#include "values.h"

namespace lightcuts::app::frame {
namespace {

const std::vector<std::string> kScenes{"study", "veach-ajar"};

const std::vector<std::string> kStages{"vpls",
                                       "vpls, 4 bounces",
                                       "light tree",
                                       "packet, none",
                                       "packet, rays",
                                       "packet, ism",
                                       "packet, ism, maps too",
                                       "everything, ism",
                                       "all lights, none",
                                       "all lights, rays",
                                       "all lights, ism",
                                       "all lights, ism, maps too",
                                       "heap, none, 4096",
                                       "heap, none, 32768",
                                       "maps, 65536",
                                       "crossing, ism",
                                       "crossing, ism, maps too",
                                       "small, none",
                                       "small, ism",
                                       "small, rays",
                                       "rays, incoherent",
                                       "pull-push, 3968, levels",
                                       "pull-push, 3968, at once"};

bool holds(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool is_in(const std::string& part, const std::string& name) { return name.find(part) != std::string::npos; }

[[noreturn]] void refuse(const std::string& part) {
  std::vector<std::string> known = kScenes;
  known.insert(known.end(), kStages.begin(), kStages.end());
  throw Error(
      Code::invalid_argument,
      fmt::format("--part {}: `frame` has no such scene, and no stage with that in its name; a part is {}, a number "
                  "of lights, or a part of a stage's name: {}{}",
                  part, fmt::join(kScenes, ", "), fmt::join(kStages, "; "), did_you_mean(part, known)));
}

}  // namespace

Parts::Parts(const std::vector<std::string>& words) {
  for (const std::string& part : words) {
    if (holds(kScenes, part)) {
      scenes_.push_back(part);
    } else if (part.find_first_not_of("0123456789") == std::string::npos) {
      numbers_.push_back(parse_count(part, 1, 1u << 30));
    } else if (std::any_of(kStages.begin(), kStages.end(), [&](const auto& stage) { return is_in(part, stage); })) {
      stages_.push_back(part);
    } else {
      refuse(part);
    }
  }
}

bool Parts::wants_scene(const std::string& name) const { return scenes_.empty() || holds(scenes_, name); }

bool Parts::wants_lights(std::uint64_t vpls) const {
  return numbers_.empty() || std::find(numbers_.begin(), numbers_.end(), vpls) != numbers_.end();
}

bool Parts::wants_stage(const std::string& stage) const {
  if (!holds(kStages, stage)) throw std::logic_error("'" + stage + "' is missing in the list of stages");
  return stages_.empty() ||
         std::any_of(stages_.begin(), stages_.end(), [&](const std::string& part) { return is_in(part, stage); });
}

bool Parts::wants_any_stage(const std::vector<std::string>& stages) const {
  return std::any_of(stages.begin(), stages.end(), [&](const std::string& stage) { return wants_stage(stage); });
}

}  // namespace lightcuts::app::frame
