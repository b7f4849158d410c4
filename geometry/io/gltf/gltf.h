// SPDX-License-Identifier: MIT
#pragma once

/// glTF 2.0, USD and MJCF: animated characters and meshes come in as motions and triangles; clips
/// go out as `.glb`, `.usda` and scenes for MuJoCo.
///
/// From the inside out:
///   gltf_sampler.h    an animation at any time
///   gltf_skeleton.h   characters by their skins, as trees
///   gltf_reader.h     ReadGltfMotion: a character, sampled
///   gltf_builder.h    a scene put together part by part
///   gltf_writer.h     a clip as .glb
///   usda_writer.h     a clip as USD text
///   mjcf_writer.h     a clip's object and hands for MuJoCo
///   gltf_onto.h       a motion in a character's own file
#include "geometry/io/gltf/gltf_onto.h"
#include "geometry/io/gltf/gltf_reader.h"
#include "geometry/io/gltf/gltf_writer.h"
#include "geometry/io/gltf/mjcf_writer.h"
#include "geometry/io/gltf/usda_writer.h"
