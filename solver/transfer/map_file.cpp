// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include <fmt/format.h>

#include "geometry/error.h"
#include "solver/transfer/surface_map.h"

namespace holdfast {

using Eigen::Matrix3Xd;

SurfaceMap SurfaceMap::FromFile(const TriangleMesh& from, const TriangleMesh& to,
                                const std::filesystem::path& path,
                                const SurfaceMapOptions& options) {
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path)) {
    throw Error(path.string(), "cannot be read", "Give a text file of pairs of points");
  }
  std::vector<std::vector<double>> rows;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    line = line.substr(0, line.find('#'));
    std::ranges::replace(line, ',', ' ');
    std::istringstream text(line);
    std::vector<double> row;
    for (std::string word; text >> word;) {
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      if (end == word.c_str() || *end != '\0' || !std::isfinite(value)) {
        throw Error(path.string(), fmt::format("line {}: '{}' is no number", number, word),
                    "A row has six numbers (x y z on the first object, x y z on the second), or "
                    "one (a vertex of the second)");
      }
      row.push_back(value);
    }
    if (row.empty()) continue;
    if ((row.size() != 6 && row.size() != 1) ||
        row.size() != (rows.empty() ? row : rows[0]).size()) {
      throw Error(path.string(), fmt::format("line {} has {} numbers", number, row.size()),
                  "A row has six numbers (x y z on the first object, x y z on the second), or one "
                  "(a vertex of the second)");
    }
    rows.push_back(std::move(row));
  }
  const bool by_vertex = !rows.empty() && rows[0].size() == 1;
  const auto count = static_cast<Eigen::Index>(rows.size());
  if (by_vertex && count != from.NumVertices()) {
    throw Error(path.string(),
                fmt::format("has {} rows, the first object {} vertices", count, from.NumVertices()),
                "Give a vertex of the second object for each vertex of the first");
  }
  Matrix3Xd on_from(3, count), on_to(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::vector<double>& row = rows[static_cast<std::size_t>(i)];
    if (!by_vertex) {
      on_from.col(i) << row[0], row[1], row[2];
      on_to.col(i) << row[3], row[4], row[5];
      continue;
    }
    if (row[0] != std::floor(row[0]) || row[0] < 0.0 ||
        row[0] >= static_cast<double>(to.NumVertices())) {
      throw Error(path.string(),
                  fmt::format("row {} names vertex {:g}, the second object has {}", i, row[0],
                              to.NumVertices()),
                  "Vertices count from 0");
    }
    on_from.col(i) = from.vertices.col(i);
    on_to.col(i) = to.vertices.col(static_cast<Eigen::Index>(row[0]));
  }
  return NamingSource("map", path.string(),
                      [&] { return Given(from, to, on_from, on_to, options); });
}

}  // namespace holdfast
