// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/common.h"
#include "geometry/mesh/mesh.h"
#include "solver/reach/reach_options.h"

namespace holdfast::apps {

/// A reach with what the command line adds to it.
struct ReachCommand {
  ReachJob job;
  std::vector<std::string> goals;      ///< "X,Y,Z", world meters, z up
  std::string track;                   ///< in place of them: a table of goals, one a frame
  std::optional<double> rate_hz;       ///< of that table
  std::vector<std::string> pushes;     ///< "FRAME,DX,DY,DZ"
  std::string from;                    ///< CLIP or CLIP:FRAME; empty: stands at the origin
  std::string body;                    ///< body model file
  std::string weights;                 ///< empty: the embedded network
  std::string approach;                ///< "X,Y,Z", or empty
  std::vector<std::string> obstacles;  ///< mesh files, world
  std::string object;                  ///< mesh or embedded object to take at the first goal
  std::string grasp = "auto";          ///< --grasp may stand alone
  bool all = false;                    ///< keep every sample
  bool write_report = true;
  std::string output = "reach";
};

/// "X,Y,Z" of an option: three finite numbers. Throws Error naming what is wrong.
Eigen::Vector3d ParsePoint(const std::string& option, const std::string& text);

/// "clip.npz:40" as a clip and its frame; without a number the frame is empty (the last). A file
/// whose name is all of the text is that file.
std::pair<std::string, std::optional<int>> ParseStart(const std::string& text);

/// Makes the motions, chooses one, and writes the result folder: clip.npz, metrics.json,
/// report.html, and with `all` samples/NN.npz. Throws FitFailure when the network's numbers break
/// in every sample.
Outcome RunReach(const ReachCommand& command, const CommonOptions& common);

/// A ball of 4 cm, 12 x 8 facets, at each goal.
TriangleMesh GoalMarkers(std::span<const Eigen::Vector3d> goals);

}  // namespace holdfast::apps
