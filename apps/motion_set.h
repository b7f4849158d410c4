// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/common.h"
#include "generator/scripted/reach_motion.h"
#include "generator/walk_statistics/motion_style.h"
#include "geometry/body/body_model.h"

namespace holdfast::apps {

/// A clip of a set of motions.
struct MotionFile {
  std::string path;  ///< or the name of an embedded clip
  std::string name;  ///< for people: without the folder and extension
};

/// A clip by itself, or all clips (.npz) in a folder and below it, by path. Where samples lie
/// beside a clip.npz, that is the best of them and left out. Throws Error for a folder without any.
std::vector<MotionFile> MotionFilesOf(const std::string& path);

/// Motions that belong together.
struct MotionSet {
  std::string label;
  std::vector<MotionFile> files;
};

/// A motion as MeasureStyle takes it. `body.surface` points into `surface`.
struct LoadedMotion {
  std::vector<BodyFrame> frames;  ///< at 30 Hz
  StyleBody body;                 ///< without limits
  std::shared_ptr<const wandr::LowestPoint> surface;
  bool other_shape = false;  ///< it has a shape that is not this body model's: not used
};

/// Reads motions with the bodies of those who move. Const and shareable.
class MotionReader {
 public:
  /// `body`: a body model's file; empty for the embedded one. Throws Error as LoadBody does.
  explicit MotionReader(const std::string& body);
  /// Throws Error, naming the file, for what is no clip of a whole body.
  LoadedMotion Read(const MotionFile& file, const CommonOptions& common) const;

 private:
  struct Person {
    BodyMeasures measures;
    std::shared_ptr<const wandr::LowestPoint> surface;
  };
  static Person Make(const std::shared_ptr<const BodyModel>& model, const Eigen::VectorXd& betas);

  std::shared_ptr<const BodyModel> model_;
  Person mean_;  // of the mean shape, made once
};

}  // namespace holdfast::apps
