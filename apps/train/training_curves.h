// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace holdfast::apps {

/// The lines of a training.jsonl up to an iteration: what was trained later is trained again. Lines
/// that are no JSON are left out; no file has none.
std::vector<nlohmann::json> LinesBefore(const std::filesystem::path& log, long iteration);

/// Something that changes with the iterations of a training.
struct Curve {
  std::string name;
  std::string color;
  std::vector<std::pair<double, double>> points;  ///< iteration, value
};

/// The number at `at` in those lines of a training.jsonl that are of `kind`, times `scale`.
Curve CurveOf(const std::vector<nlohmann::json>& lines, const std::string& kind,
              const nlohmann::json::json_pointer& at, double scale, std::string name,
              std::string color);

/// A chart (HTML) up to iteration `iterations`, with the last values below it; empty without
/// points. A logarithmic one leaves out what is not positive.
std::string Figure(const std::string& title, const std::vector<Curve>& curves, double iterations,
                   bool logarithmic);

/// A page of charts, complete in itself.
std::string PageOfFigures(const std::string& title, const std::vector<std::string>& figures);

}  // namespace holdfast::apps
