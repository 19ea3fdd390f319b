#pragma once

#include "backend/emitter_table.h"
#include "cpu/cpu_scene.h"
