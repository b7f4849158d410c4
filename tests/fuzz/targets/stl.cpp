// SPDX-License-Identifier: MIT
#include "tests/fuzz/mesh_checks.h"

HOLDFAST_FUZZ_TARGET(stl) { holdfast::fuzz::ReadMeshAndBack(trial, ".stl"); }
