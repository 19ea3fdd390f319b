#include "cuda/map_rounds.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace lightcuts::cuda {
namespace {

class Rounds {
 public:
  Rounds(Device& device, LightMaps& maps, const TreeViews& trees, const UnitList& all, std::uint32_t units_of_tile,
         const UnitWork& work, const std::function<bool(double)>& go_on, std::uint64_t& rounds)
      : device_(device),
        maps_(maps),
        trees_(trees),
        all_(all),
        units_of_tile_(units_of_tile),
        work_(work),
        go_on_(go_on),
        rounds_(rounds),
        missed_{DeviceBuffer<std::uint32_t>(device, all.count), DeviceBuffer<std::uint32_t>(device, all.count)},
        missed_count_(device, 1) {}

  bool run() {
    if (maps_.add_first(trees_) || start_over()) {
      if (!ask()) return false;
      const Outcome outcome = light(all_);
      return outcome == Outcome::no_room ? run_in_batches(fetch_left()) : outcome == Outcome::lit;
    }
    return run_in_batches(all_units());
  }

 private:
  /// In order: neighbours ask for the same maps.
  std::vector<std::uint32_t> all_units() const {
    std::vector<std::uint32_t> units(all_.count);
    if (all_.units == nullptr) {
      std::iota(units.begin(), units.end(), 0u);
      return units;
    }
    check(cudaMemcpy(units.data(), all_.units, units.size() * sizeof(std::uint32_t), cudaMemcpyDeviceToHost),
          "fetching a list");
    std::sort(units.begin(), units.end());
    return units;
  }

  enum class Outcome { lit, stopped, no_room };

  /// Forgets all maps but the first; false where not even those fit.
  bool start_over() {
    maps_.clear();
    return maps_.add_first(trees_);
  }

  /// Makes most of the maps that will be wanted, where there are hardly any; false to stop.
  bool ask() {
    if (!work_.ask || !maps_.has_hardly_any()) return true;
    if (!work_.ask(all_)) return false;
    maps_.add_wanted();  // if they fit; perhaps fewer are wanted in the end
    return true;
  }

  /// Lights units until none misses a map, or until there is no room for maps; those that are not lit are then `left_`.
  Outcome light(UnitList list) {
    while (true) {
      missed_count_.fill_bytes(0);
      DeviceBuffer<std::uint32_t>& missed = missed_[turn_];
      ++rounds_;
      if (!work_.light(list, {missed.data(), missed_count_.data()})) return Outcome::stopped;
      missed_count_.download(&left_, 1);
      if (left_ == 0) return Outcome::lit;
      list = {missed.data(), left_};
      turn_ = 1 - turn_;
      if (!maps_.add_wanted()) return Outcome::no_room;
      if (!go_on_(1 - static_cast<double>(waiting_ + left_) / all_.count)) return Outcome::stopped;
    }
  }

  /// What `light` left, in order: neighbours ask for the same maps.
  std::vector<std::uint32_t> fetch_left() {
    std::vector<std::uint32_t> units(left_);
    missed_[1 - turn_].download(units.data(), left_);
    std::sort(units.begin(), units.end());
    return units;
  }

  /// Lights units a batch at a time: smaller and smaller ones until their maps fit.
  bool run_in_batches(std::vector<std::uint32_t> todo) {
    std::reverse(todo.begin(), todo.end());  // the next ones are last
    std::size_t batch = std::max<std::size_t>(1, todo.size() / 2);
    if (!start_over()) return run_alone(todo);
    bool fresh = true;
    while (!todo.empty()) {
      const std::size_t count = std::min(batch, todo.size());
      DeviceBuffer<std::uint32_t> units(device_, count);
      units.upload(todo.data() + (todo.size() - count), count);
      device_.synchronize();
      todo.resize(todo.size() - count);
      waiting_ = todo.size();
      const Outcome outcome = light({units.data(), static_cast<std::uint32_t>(count)});
      if (outcome == Outcome::stopped) return false;
      if (outcome == Outcome::lit) {
        fresh = false;
        continue;
      }
      const std::vector<std::uint32_t> left = fetch_left();
      todo.insert(todo.end(), left.rbegin(), left.rend());
      if (fresh && left.size() == count) {
        if (count == 1 && !run_alone(take_a_tile(todo))) return false;
        batch = std::max<std::size_t>(1, count / 2);
      }
      start_over();
      fresh = true;
    }
    return true;
  }

  /// The units that come next, as far as they are of one tile.
  std::vector<std::uint32_t> take_a_tile(std::vector<std::uint32_t>& todo) const {
    std::vector<std::uint32_t> units;
    const std::uint32_t tile = todo.back() / units_of_tile_;
    for (; !todo.empty() && todo.back() / units_of_tile_ == tile; todo.pop_back()) units.push_back(todo.back());
    return units;
  }

  /// Lights units one by one, with what was looked up in maps that are gone.
  bool run_alone(const std::vector<std::uint32_t>& units) {
    for (std::size_t i = 0; i < units.size(); ++i) {
      DeviceBuffer<std::uint32_t> unit(device_, 1);
      unit.upload(&units[i], 1);
      if (i == 0 || units[i] / units_of_tile_ != units[i - 1] / units_of_tile_) maps_.forget_table();
      const auto fill = [&](const std::uint32_t* ids, std::uint32_t count, int kind, std::uint8_t* shares) {
        work_.look_up(units[i], kind, ids, count, shares);
      };
      do {
        maps_.look_up_wanted(trees_, fill);
        missed_count_.fill_bytes(0);
        ++rounds_;
        if (!work_.light({unit.data(), 1}, {missed_[0].data(), missed_count_.data()})) return false;
        missed_count_.download(&left_, 1);
      } while (left_ > 0);
      if (!go_on_(1 - static_cast<double>(units.size() - i) / all_.count)) return false;
    }
    maps_.forget_table();
    return true;
  }

  Device& device_;
  LightMaps& maps_;
  const TreeViews& trees_;
  UnitList all_;
  std::uint32_t units_of_tile_;
  const UnitWork& work_;
  const std::function<bool(double)>& go_on_;
  std::uint64_t& rounds_;
  DeviceBuffer<std::uint32_t> missed_[2];
  DeviceBuffer<std::uint32_t> missed_count_;
  int turn_ = 0;
  std::uint32_t left_ = 0;
  std::size_t waiting_ = 0;  ///< units of later batches
};

}  // namespace

bool light_in_rounds(Device& device, LightMaps& maps, const TreeViews& trees, const UnitList& all,
                     std::uint32_t units_of_tile, const UnitWork& work, const std::function<bool(double)>& go_on,
                     std::uint64_t& rounds) {
  return Rounds(device, maps, trees, all, units_of_tile, work, go_on, rounds).run();
}

}  // namespace lightcuts::cuda
