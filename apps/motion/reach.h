// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/common.h"
#include "solver/reach/reach_options.h"

namespace holdfast::apps {

/// A reach with the additional inputs of the command line.
struct ReachCommand {
  ReachJob job;
  std::vector<std::string> goals;      ///< "X,Y,Z", world meters, z up
  std::string track;                   ///< instead of `goals`: table with one goal per frame
  std::optional<double> rate_hz;       ///< of that table
  std::vector<std::string> pushes;     ///< "FRAME,DX,DY,DZ"
  std::string from;                    ///< CLIP or CLIP:FRAME; empty: stands at the origin
  std::string body;                    ///< body model file
  std::string weights;                 ///< empty: the embedded network
  std::string approach;                ///< "X,Y,Z", or empty
  std::vector<std::string> obstacles;  ///< mesh files, world
  std::string object;                  ///< mesh or embedded object to take at the first goal
  std::string grasp = "auto";          ///< --grasp may have no value
  bool all = false;                    ///< keeps all samples
  bool write_report = true;
  std::string output = "reach";
};

/// Parses "X,Y,Z" of an option: three finite numbers. Throws Error if the text is invalid.
Eigen::Vector3d ParsePoint(const std::string& option, const std::string& text);

/// Splits "clip.npz:40" into a clip and its frame. Without a number the frame is empty (the last
/// one). If a file has the whole text as its name, it is that file.
std::pair<std::string, std::optional<int>> ParseStart(const std::string& text);

/// Generates the motions, selects one, and writes the result folder: clip.npz, metrics.json,
/// report.html, and with `all` samples/NN.npz. Throws FitFailure if every sample diverges
/// (non-finite state).
Outcome RunReach(const ReachCommand& command, const CommonOptions& common);

}  // namespace holdfast::apps
