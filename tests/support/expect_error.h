#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "lightcuts/error.h"

namespace lightcuts {

/// Runs `action` and expects an Error of that code whose sentence contains `part`.
inline void expect_error(Code code, const std::string& part, const std::function<void()>& action) {
  try {
    action();
    ADD_FAILURE() << "no error, but one about '" << part << "' was expected";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), code) << e.what();
    EXPECT_THAT(e.what(), testing::HasSubstr(part));
  }
}

}  // namespace lightcuts
