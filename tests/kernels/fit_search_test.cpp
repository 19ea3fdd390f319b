#include "kernels/fit_search.h"

#include <gtest/gtest.h>

namespace lightcuts {
namespace {

/// The factor that is found where exactly those from `least` on fit, and how many are tried.
struct Found {
  float scale;
  bool raised;
  int tries;
};
Found search(float least) {
  FitSearch search;
  int tries = 1;
  while (search.next(search.scale >= least)) ++tries;
  return {search.scale, search.raised, tries};
}

TEST(FitSearch, LeavesAloneWhatFits) {
  const Found found = search(0.5f);
  EXPECT_EQ(found.scale, 1.0f);
  EXPECT_FALSE(found.raised);
  EXPECT_EQ(found.tries, 1);
}

TEST(FitSearch, FindsTheSmallestFactorThatFits) {
  for (const float least : {1.001f, 2.0f, 15.9f, 16.0f, 16.1f, 300.0f, 1e6f, 1e20f}) {
    const Found found = search(least);
    EXPECT_TRUE(found.raised);
    EXPECT_GE(found.scale, least);
    EXPECT_LE(found.scale, 1.004f * least) << least;
    EXPECT_LE(found.tries, 32);
  }
}

TEST(FitSearch, EndsWhereNothingFits) {
  const Found found = search(kInfinity);
  EXPECT_GE(found.scale, 1e30f);
  EXPECT_LT(found.tries, 64);
}

}  // namespace
}  // namespace lightcuts
