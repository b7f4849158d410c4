// SPDX-License-Identifier: MIT
#include "geometry/render/rasterizer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/render/lighting.h"
#include "geometry/render/visibility.h"

namespace holdfast {
namespace {

using Color = Eigen::Vector3f;  // linear light

constexpr double kShadowCell = 0.75;  // fraction of a pixel at the nearest vertex
constexpr double kGridLine = 0.012;   // width of a line, fraction of the spacing
constexpr float kGridStrength = 0.16f;

void Check(std::span<const RenderItem> items, const RenderOptions& options) {
  if (options.supersampling < 1 || options.supersampling > 4) {
    throw Error("render", fmt::format("supersampling {}", options.supersampling), "Use 1 to 4.");
  }
  for (std::size_t i = 0; i < items.size(); ++i) {
    const RenderItem& item = items[i];
    const std::string where = fmt::format("render item {}", i);
    if (item.mesh == nullptr) throw Error(where, "has no mesh", "");
    const TriangleMesh& mesh = *item.mesh;
    if (mesh.NumFaces() > 0 &&
        (mesh.faces.minCoeff() < 0 || mesh.faces.maxCoeff() >= mesh.NumVertices())) {
      throw Error(where, "a face refers to a vertex that does not exist", "");
    }
    if (item.vertex_colors && item.vertex_colors->cols() != mesh.NumVertices()) {
      throw Error(where,
                  fmt::format("{} vertex colors for {} vertices", item.vertex_colors->cols(),
                              mesh.NumVertices()),
                  "Give one color per vertex.");
    }
  }
}

// Meshes that cast a shadow.
std::vector<const TriangleMesh*> Solid(std::span<const RenderItem> items) {
  std::vector<const TriangleMesh*> meshes;
  for (const RenderItem& item : items) {
    if (!item.translucent) meshes.push_back(item.mesh);
  }
  return meshes;
}

// All triangles of a scene in one list, with the vertex data for shading.
class Scene {
 public:
  Scene(std::span<const RenderItem> items, const View& view) {
    for (const RenderItem& item : items) {
      const TriangleMesh& mesh = *item.mesh;
      const auto first_vertex = static_cast<int>(position_.size());
      const Eigen::Matrix3Xd normals = VertexNormals(mesh);
      const Color color = LinearFromSrgb(item.color);
      for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) {
        position_.push_back(view.ToCamera(mesh.vertices.col(v)));
        normal_.push_back(normals.col(v).cast<float>());
        color_.push_back(item.vertex_colors ? LinearFromSrgb(item.vertex_colors->col(v)) : color);
      }
      for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
        triangle_.push_back(mesh.faces.col(f).array() + first_vertex);
        translucent_.push_back(item.translucent);
      }
    }
  }

  void Draw(VisibilityBuffer& buffer) const {
    for (std::size_t t = 0; t < triangle_.size(); ++t) {
      const Eigen::Vector3i& corner = triangle_[t];
      buffer.Draw(position_[corner[0]], position_[corner[1]], position_[corner[2]],
                  static_cast<std::uint32_t>(t + 1), translucent_[t]);
    }
  }

  // Depth of the nearest vertex in front of the camera, meters.
  double Nearest(double near) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& p : position_) {
      if (p.z() >= near) nearest = std::min(nearest, p.z());
    }
    return nearest;
  }

  // Color of triangle `id` at its intersection with the ray (camera frame).
  Color Shade(std::uint32_t id, const Eigen::Vector3d& ray, const View& view,
              const Lighting& lighting, const ShadowMap& shadows) const {
    const Eigen::Vector3i& corner = triangle_[id - 1];
    const Eigen::Vector3d& a = position_[corner[0]];
    const Eigen::Vector3d& b = position_[corner[1]];
    const Eigen::Vector3d& c = position_[corner[2]];
    // Cramer's rule for [a b c] w = t ray: perspective-correct barycentric coordinates up to scale.
    const Eigen::Vector3d bc = b.cross(c);
    Eigen::Vector3d w(bc.dot(ray), c.cross(a).dot(ray), a.cross(b).dot(ray));
    const double sum = w.sum();
    w = sum != 0.0 ? Eigen::Vector3d(w / sum) : Eigen::Vector3d(Eigen::Vector3d::Constant(1.0 / 3));
    // A pixel's mean sample may lie just outside a sliver.
    w = w.cwiseMax(0.0);
    w /= w.sum();
    const Eigen::Vector3f weight = w.cast<float>();

    const Color albedo = color_[corner[0]] * weight[0] + color_[corner[1]] * weight[1] +
                         color_[corner[2]] * weight[2];
    Eigen::Vector3f normal = normal_[corner[0]] * weight[0] + normal_[corner[1]] * weight[1] +
                             normal_[corner[2]] * weight[2];
    const Eigen::Matrix3f world_from_camera = view.CameraFromWorld().transpose().cast<float>();
    const Eigen::Vector3f to_eye = -(world_from_camera * ray.cast<float>()).normalized();
    // If (b - a) x (c - a) points away from the eye, the face is seen from inside.
    if (bc.dot(a) > 0.0) normal = -normal;
    const float length = normal.norm();
    normal = length > 1e-6f ? Eigen::Vector3f(normal / length) : to_eye;
    const Eigen::Vector3d point =
        view.Eye() + view.CameraFromWorld().transpose() * (w[0] * a + w[1] * b + w[2] * c);
    const float key = shadows.Light(point, normal.cast<double>());
    return lighting.Shade(albedo, normal, to_eye, key);
  }

 private:
  std::vector<Eigen::Vector3d> position_;  // camera frame
  std::vector<Eigen::Vector3f> normal_;    // world
  std::vector<Color> color_;
  std::vector<Eigen::Vector3i> triangle_;
  std::vector<bool> translucent_;  // per triangle
};

// Fraction of a pixel of width `footprint` at coordinate `x` covered by lines `spacing` apart.
float GridLine(double x, double footprint, double spacing) {
  const double distance = std::abs(x - spacing * std::round(x / spacing));
  const double half_line = 0.5 * kGridLine * spacing;
  const double covered = std::min(distance + 0.5 * footprint, half_line) -
                         std::max(distance - 0.5 * footprint, -half_line);
  return static_cast<float>(std::clamp(covered / footprint, 0.0, 1.0));
}

// The horizontal plane as seen along a camera ray.
class Ground {
 public:
  Ground(std::span<const RenderItem> items, const View& view, const Lighting& lighting,
         const RenderOptions& options)
      : view_(view),
        shadow_(options.ground ? Solid(items) : std::vector<const TriangleMesh*>(),
                options.ground_height_m, lighting.to_key.cast<double>()),
        color_(LinearFromSrgb({0.84, 0.85, 0.86})),
        background_(LinearFromSrgb(options.background)),
        grid_spacing_(options.grid_spacing_m),
        eye_height_(view.Eye().z() - options.ground_height_m),
        visible_(options.ground && eye_height_ > 0.0) {
    world_from_camera_ = view.CameraFromWorld().transpose();
    // The plane fades into the background some distance behind the scene.
    Eigen::AlignedBox3d box;
    for (const RenderItem& item : items) {
      for (Eigen::Index v = 0; v < item.mesh->NumVertices(); ++v) {
        if (item.mesh->vertices.col(v).allFinite()) box.extend(item.mesh->vertices.col(v));
      }
    }
    if (!box.isEmpty()) {
      center_ = box.center().head<2>();
      fade_ = 2.5 * std::max(0.5 * box.diagonal().norm(), 0.05);
    }
  }

  // 1 / z at which the ray meets the plane; 0 if never.
  double InverseDepth(const Eigen::Vector3d& ray) const {
    if (!visible_) return 0.0;
    return std::max(0.0, -world_from_camera_.row(2).dot(ray) / eye_height_);
  }

  bool Visible() const { return visible_; }
  Color Background() const { return background_; }

  Color Shade(const Eigen::Vector3d& ray, double inverse_depth) const {
    const Eigen::Vector3d direction = world_from_camera_ * ray;
    const Eigen::Vector3d p = view_.Eye() + direction / inverse_depth;
    const double away = (p.head<2>() - center_).norm() / fade_;
    const auto presence = static_cast<float>(std::exp(-away * away));
    if (presence < 0.002f) return background_;
    Color color = color_ * shadow_.Light(p.x(), p.y());
    if (grid_spacing_ > 0.0) {
      // Footprint of a pixel on the plane: proportional to distance, elongated at low angles.
      const double width = direction.norm() / (inverse_depth * view_.Focal());
      const double stretch = std::min(direction.norm() / std::abs(direction.z()), 50.0);
      const Eigen::Vector2d heading = direction.head<2>().normalized();
      const auto footprint = [&](int axis) {
        return width * (1.0 + (stretch - 1.0) * std::abs(heading[axis]));
      };
      const float line = std::max(GridLine(p.x(), footprint(0), grid_spacing_),
                                  GridLine(p.y(), footprint(1), grid_spacing_));
      color *= 1.0f - kGridStrength * line;
    }
    return background_ + presence * (color - background_);
  }

 private:
  const View& view_;
  GroundShadow shadow_;
  Color color_, background_;
  double grid_spacing_;
  Eigen::Matrix3d world_from_camera_;
  Eigen::Vector2d center_ = Eigen::Vector2d::Zero();
  double fade_ = 2.0;
  double eye_height_;
  bool visible_;
};

}  // namespace

Image Render(std::span<const RenderItem> items, const Camera& camera,
             const RenderOptions& options) {
  Check(items, options);
  const int n = options.supersampling;
  const View view(camera, options.width, options.height);
  const View sample_view(camera, n * options.width, n * options.height);
  const Scene scene(items, view);
  VisibilityBuffer buffer(sample_view);
  scene.Draw(buffer);

  const Lighting lighting(view);
  const Ground ground(items, view, lighting, options);
  const ShadowMap shadows(Solid(items), lighting.to_key.cast<double>(),
                          kShadowCell * scene.Nearest(view.Near()) / view.Focal());
  constexpr std::uint32_t kGround = 0xffffffffu;
  // Samples of one pixel that show the same triangle are shaded once, at their mean position.
  struct Share {
    std::uint32_t id;
    int count;
    double x, y;
  };
  std::array<Share, 16> share;
  Image image(options.width, options.height);
  std::array<std::uint8_t, 3> background;
  for (int c = 0; c < 3; ++c) background[c] = SrgbByteFromLinear(ground.Background()[c]);
  for (int y = 0; y < options.height; ++y) {
    for (int x = 0; x < options.width; ++x) {
      int shares = 0;
      for (int k = 0; k < n * n; ++k) {
        const int sx = n * x + k % n;
        const int sy = n * y + k / n;
        std::uint32_t id = buffer.Id(sx, sy);
        if (ground.Visible() && ground.InverseDepth(sample_view.RayInCamera(sx + 0.5, sy + 0.5)) >
                                    static_cast<double>(buffer.InverseDepth(sx, sy))) {
          id = kGround;
        }
        int s = 0;
        while (s < shares && share[s].id != id) ++s;
        if (s == shares) share[shares++] = {id, 0, 0.0, 0.0};
        ++share[s].count;
        share[s].x += sx + 0.5;
        share[s].y += sy + 0.5;
      }
      if (shares == 1 && share[0].id == VisibilityBuffer::kNothing) {
        std::ranges::copy(background, image.Pixel(x, y));
        continue;
      }
      Color sum = Color::Zero();
      for (int s = 0; s < shares; ++s) {
        const double weight = 1.0 / share[s].count;
        const Eigen::Vector3d ray =
            sample_view.RayInCamera(weight * share[s].x, weight * share[s].y);
        Color color = ground.Background();
        if (share[s].id == kGround) {
          color = ground.Shade(ray, ground.InverseDepth(ray));
        } else if (share[s].id != VisibilityBuffer::kNothing) {
          color = scene.Shade(share[s].id, ray, view, lighting, shadows);
        }
        sum += static_cast<float>(share[s].count) * color;
      }
      sum /= static_cast<float>(n * n);
      std::uint8_t* const pixel = image.Pixel(x, y);
      for (int c = 0; c < 3; ++c) pixel[c] = SrgbByteFromLinear(sum[c]);
    }
  }
  return image;
}

}  // namespace holdfast
