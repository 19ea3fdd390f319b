#pragma once

#include "backend/scene_arrays.h"

namespace lightcuts {

using CpuScene = SceneArrays;

}  // namespace lightcuts
