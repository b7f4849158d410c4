// SPDX-License-Identifier: MIT
#include "tests/fuzz/mesh_checks.h"

HOLDFAST_FUZZ_TARGET(obj) { holdfast::fuzz::ReadMeshAndBack(trial, ".obj"); }
