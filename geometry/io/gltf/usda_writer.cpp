// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/usda_writer.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kFramesAtOnce = 32;  // formatted in memory before they are written

using Text = std::back_insert_iterator<std::string>;

// A USD string literal.
std::string Quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c == '\n' || c == '\r' ? ' ' : c;
  }
  return result + '"';
}

template <typename Points>
void WritePoints(const Points& points, Text out) {
  const char* separator = "";
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    fmt::format_to(out, "{}({:.5f}, {:.5f}, {:.5f})", separator, points(0, v), points(1, v),
                   points(2, v));
    separator = ", ";
  }
}

std::string Range(const Eigen::Matrix3Xd& points) {
  Eigen::Matrix<double, 3, 2> corners;
  corners << points.rowwise().minCoeff(), points.rowwise().maxCoeff();
  std::string text;
  WritePoints(corners, std::back_inserter(text));
  return text;
}

// Opens a mesh and writes its constant part.
std::string MeshHead(std::string_view name, const Eigen::Matrix3Xi& faces, std::string_view color,
                     bool double_sided) {
  std::string text;
  const Text out = std::back_inserter(text);
  fmt::format_to(out, "\n    def Mesh \"{}\"\n    {{\n", name);
  if (double_sided) text += "        uniform bool doubleSided = 1\n";
  text += "        int[] faceVertexCounts = [";
  for (Eigen::Index f = 0; f < faces.cols(); ++f) text += f == 0 ? "3" : ", 3";
  text += "]\n        int[] faceVertexIndices = [";
  for (Eigen::Index k = 0; k < faces.size(); ++k) {
    fmt::format_to(out, "{}{}", k == 0 ? "" : ", ", faces(k));
  }
  fmt::format_to(out,
                 "]\n        color3f[] primvars:displayColor = [{}] (\n"
                 "            interpolation = \"constant\"\n        )\n"
                 "        uniform token subdivisionScheme = \"none\"\n",
                 color);
  return text;
}

std::string ObjectPrim(const Clip& clip, const TriangleMesh& object,
                       const std::vector<int>& frames) {
  std::string text = MeshHead("object", object.faces, "(0.16, 0.38, 0.62)", true);
  const Text out = std::back_inserter(text);
  fmt::format_to(out, "        float3[] extent = [{}]\n        point3f[] points = [",
                 Range(object.vertices));
  WritePoints(object.vertices, out);
  text += "]\n        matrix4d xformOp:transform.timeSamples = {\n";
  for (const int t : frames) {
    // USD uses row vectors: x_world = x_object M.
    const Eigen::Matrix3d M = ExpSO3(clip.object->orient.col(t)).transpose();
    const Eigen::Vector3d T = clip.object->trans.col(t);
    fmt::format_to(out, "            {}: ( ", t);
    for (int row = 0; row < 3; ++row) {
      fmt::format_to(out, "({:.9f}, {:.9f}, {:.9f}, 0), ", M(row, 0), M(row, 1), M(row, 2));
    }
    fmt::format_to(out, "({:.6f}, {:.6f}, {:.6f}, 1) ),\n", T.x(), T.y(), T.z());
  }
  text += "        }\n        uniform token[] xformOpOrder = [\"xformOp:transform\"]\n    }\n";
  return text;
}

}  // namespace

void WriteUsda(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
               const UsdaOptions& options, const std::filesystem::path& path) {
  std::vector<int> frames;
  for (int t = 0; t < clip.NumFrames(); t += options.every) frames.push_back(t);
  const auto num_frames = static_cast<int>(frames.size());
  WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file << fmt::format(
        "#usda 1.0\n(\n    defaultPrim = \"World\"\n    doc = {}\n    endTimeCode = {}\n"
        "    framesPerSecond = {:.9g}\n    metersPerUnit = 1\n    startTimeCode = 0\n"
        "    timeCodesPerSecond = {:.9g}\n    upAxis = \"Z\"\n)\n\n"
        "def Xform \"World\"\n{{",
        Quoted("Made by " + options.generator), clip.NumFrames() - 1, clip.frame_rate,
        clip.frame_rate);
    file << MeshHead("body", surface.Faces(), "(0.78, 0.6, 0.5)", false);
    file << "        point3f[] points.timeSamples = {\n";
    std::string extents;
    std::vector<std::string> points(kFramesAtOnce), ranges(kFramesAtOnce);
    std::vector<BodyState> states(std::min(kFramesAtOnce, num_frames));
    for (int begin = 0; begin < num_frames; begin += kFramesAtOnce) {
      const int count = std::min(kFramesAtOnce, num_frames - begin);
      ParallelFor(count, options.threads, [&](int k) {
        const int t = frames[begin + k];
        Forward(surface, clip.pose[t], clip.trans.col(t), states[k]);
        points[k].clear();
        WritePoints(states[k].vertices, std::back_inserter(points[k]));
        ranges[k] = Range(states[k].vertices);
      });
      for (int k = 0; k < count; ++k) {
        const int t = frames[begin + k];
        file << "            " << t << ": [" << points[k] << "],\n";
        extents += fmt::format("            {}: [{}],\n", t, ranges[k]);
        if (options.progress) options.progress(begin + k + 1, num_frames);
      }
    }
    file << "        }\n        float3[] extent.timeSamples = {\n"
         << extents << "        }\n    }\n";
    if (object != nullptr && clip.object) file << ObjectPrim(clip, *object, frames);
    file << "}\n";
    file.flush();
    if (!file) {
      throw Error(path.string(), fmt::format("cannot be written ({})", std::strerror(errno)),
                  "Free disk space, or choose another folder");
    }
  });
}

}  // namespace holdfast
