#pragma once

namespace lightcuts::oracle {

/// What shares of light say of pairs of a light and a place that rays call lit or dark; "lit" is a share above one half.
struct Tally {
  double lit = 0, dark = 0, wrongly_lit = 0, wrongly_dark = 0;  ///< pairs
  double lit_share = 0, dark_share = 0;                         ///< sums

  void add(bool visible, float share) {
    (visible ? lit : dark) += 1;
    (visible ? lit_share : dark_share) += share;
    wrongly_lit += !visible && share > 0.5f ? 1 : 0;
    wrongly_dark += visible && !(share > 0.5f) ? 1 : 0;
  }
  [[nodiscard]] double pairs() const { return lit + dark; }
  [[nodiscard]] double agreement() const { return 1 - (wrongly_lit + wrongly_dark) / pairs(); }
  /// Mean of the shares of lit and of dark pairs that were recognised.
  [[nodiscard]] double balanced() const { return 1 - 0.5 * (wrongly_lit / dark + wrongly_dark / lit); }
  /// Mean of what arrives where rays do, and where none does.
  [[nodiscard]] double kept() const { return lit_share / lit; }
  [[nodiscard]] double leaked() const { return dark_share / dark; }
};

}  // namespace lightcuts::oracle
