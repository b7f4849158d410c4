// SPDX-License-Identifier: MIT
#include "tests/fuzz/mesh_checks.h"

HOLDFAST_FUZZ_TARGET(ply) { holdfast::fuzz::ReadMeshAndBack(trial, ".ply"); }
