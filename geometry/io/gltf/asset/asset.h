// SPDX-License-Identifier: MIT
#pragma once

/// The parts of a glTF 2.0 file, checked: bytes come in; nodes, meshes, skins, animations and the
/// numbers behind them come out.
///
/// From the inside out:
///   gltf_container.h  JSON text and binary chunk, buffers
///   gltf_asset.h      nodes, accessors, skins, animations
#include "geometry/io/gltf/asset/gltf_asset.h"
