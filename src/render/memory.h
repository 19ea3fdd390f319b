#pragma once

#include <cstdint>

namespace lightcuts {

/// The largest memory that this process has had so far [bytes]; 0 where the system does not tell.
std::uint64_t peak_memory_bytes();

/// Three quarters of the memory that is free now [bytes]; 0 where the system does not tell.
std::uint64_t default_memory_budget();

}  // namespace lightcuts
