// SPDX-License-Identifier: MIT
#include "tests/fuzz/mesh_checks.h"

HOLDFAST_FUZZ_TARGET(off) { holdfast::fuzz::ReadMeshAndBack(trial, ".off"); }
