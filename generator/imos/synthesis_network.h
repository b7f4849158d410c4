// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "generator/imos/vocabulary.h"
#include "generator/imos/weights.h"

namespace holdfast {

/// Weights of the IMoS generator, their origin, and a summary of the training data.
struct SynthesisNetwork {
  std::string source;  ///< the file, or "embedded"
  imos::NetworkWeights weights;
  std::string checksum;                        ///< identifies the network
  Eigen::MatrixXf action_table;                ///< (29 x E)
  std::map<std::string, double> seconds;       ///< per key frame, by action, mean of the data
  std::map<std::string, nlohmann::json> seen;  ///< by action: objects and their counts

  /// Actions in the training data, in vocabulary order; all if the file does not list them.
  std::vector<std::string> Actions() const;
  /// Mean for the action; if unknown, the mean over all actions, or IMoS's 0.1 s.
  double SecondsPerKeyFrame(int action) const;
  nlohmann::json ToJson() const;
};

/// Reads the weights in a file, or the embedded ones if `path` is empty. Action embeddings are read
/// from `embeddings` (imos::ReadActionTable) unless it is empty. Throws Error if there are none.
SynthesisNetwork LoadSynthesisNetwork(const std::string& path = {},
                                      const std::string& embeddings = {});

}  // namespace holdfast

namespace holdfast::imos {

/// Returns whether the library has embedded trained weights (meshes/networks/imos.safetensors).
bool HasDefaultNetwork();

/// Returns the embedded weights. Throws Error if there are none.
NetworkWeights DefaultNetwork();

}  // namespace holdfast::imos
