// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/import/load_clip.h"
#include "solver/carry/carry.h"

namespace holdfast::testing {

/// The demo's mug, carried for some frames.
inline ClipScene CarriedMug(int frames) {
  const LoadedClip motion = LoadClip("demo_drink");
  const PreparedObject object = PrepareObject(LoadObject("mug"));
  const CarryReport carried = CarryObject(Slice(motion.clip, 0, frames), motion.body, object);
  ClipScene scene;
  scene.source = "carried";
  scene.clip = carried.clip;
  scene.body = motion.body.model;
  scene.betas = motion.body.betas;
  scene.object = object.object.mesh;
  scene.object_source = "mug";
  return scene;
}

}  // namespace holdfast::testing
