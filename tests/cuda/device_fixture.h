#pragma once

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>

#include "cuda/device.h"

namespace lightcuts::cuda {

/// True where a checker runs: sizes that still cross every branch.
inline bool reduced() { return std::getenv("LIGHTCUTS_TEST_REDUCED") != nullptr; }

/// Test on a GPU; skipped with a word where there is none.
class OnDevice : public testing::Test {
 protected:
  void SetUp() override {
    int count = 0;
    if (cudaGetDeviceCount(&count) != cudaSuccess || count == 0) GTEST_SKIP() << "no CUDA device answers here";
    device = std::make_unique<Device>(0, 0);
  }
  std::unique_ptr<Device> device;
};

}  // namespace lightcuts::cuda
