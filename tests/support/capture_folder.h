// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <fstream>

#include "tests/generator/test_body.h"
#include "tests/support/walking_figure.h"

namespace holdfast::testing {

/// A set of captures of two subjects, with an index.
inline void WriteCaptures(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const BodyMeasures& body = DefaultMeasures();
  WriteClip(StandingFigure(body, 120), folder / "stand.npz");
  WriteClip(WalkingFigure(body, 240, 1.0), folder / "walk.npz");
  WriteClip(WalkingFigure(body, 90, 1.0), folder / "walk_other.npz");
  WriteClip(ReachingFigure(body, 121, 0.7), folder / "low.npz");
  WriteClip(ReachingFigure(body, 121, 1.2), folder / "high.npz");
  std::ofstream(folder / "index.csv") << "file,subject,category,fps,hand,key_frame\n"
                                         "stand.npz,ann,idle,30,,\n"
                                         "walk.npz,ann,walk,30,,\n"
                                         "walk_other.npz,bob,walk,30,,\n"
                                         "low.npz,ann,reach,30,right,60\n"
                                         "high.npz,ann,reach,30,right,60\n";
}

}  // namespace holdfast::testing
