// SPDX-License-Identifier: MIT
#include "geometry/render/rasterizer.h"

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/render/image.h"
#include "geometry/render/lighting.h"
#include "geometry/render/visibility.h"

namespace holdfast {
namespace {

TriangleMesh Sphere(const Eigen::Vector3d& center, double radius, int rings = 64) {
  TriangleMesh mesh;
  const int segments = 2 * rings;
  mesh.vertices.resize(3, (rings + 1) * segments);
  mesh.faces.resize(3, 2 * rings * segments);
  int face = 0;
  for (int i = 0; i <= rings; ++i) {
    const double polar = std::numbers::pi * i / rings;
    for (int j = 0; j < segments; ++j) {
      const double azimuth = 2.0 * std::numbers::pi * j / segments;
      mesh.vertices.col(i * segments + j) =
          center + radius * Eigen::Vector3d(std::sin(polar) * std::cos(azimuth),
                                            std::sin(polar) * std::sin(azimuth), std::cos(polar));
      if (i == rings) continue;
      const int next = (j + 1) % segments;
      const Eigen::Vector4i q(i * segments + j, (i + 1) * segments + j, (i + 1) * segments + next,
                              i * segments + next);
      mesh.faces.col(face++) = Eigen::Vector3i(q[0], q[1], q[2]);
      mesh.faces.col(face++) = Eigen::Vector3i(q[0], q[2], q[3]);
    }
  }
  return mesh;
}

TriangleMesh Triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                      const Eigen::Vector3d& c) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << a, b, c;
  mesh.faces = Eigen::Vector3i(0, 1, 2);
  return mesh;
}

RenderOptions Bare(int width = 320, int height = 240) {
  RenderOptions options;
  options.width = width;
  options.height = height;
  options.ground = false;
  options.background = Eigen::Vector3d::Ones();
  return options;
}

int CountDrawn(const Image& image) {
  int count = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    count += image.rgb[i] != 255 || image.rgb[i + 1] != 255 || image.rgb[i + 2] != 255;
  }
  return count;
}

bool Reddish(const std::uint8_t* p) { return p[0] > p[1] + 40 && p[0] > p[2] + 40; }
bool Bluish(const std::uint8_t* p) { return p[2] > p[0] + 40 && p[2] > p[1] + 20; }

TEST(Render, SphereCoversTheAnalyticArea) {
  // Seen from distance d a sphere of radius r fills a disc of f r / sqrt(d^2 - r^2) pixels.
  for (const double distance : {1.0, 2.0, 5.0}) {
    const TriangleMesh sphere = Sphere(Eigen::Vector3d(0.0, 0.0, 1.0), 0.25);
    const Camera camera = OrbitCamera({0.0, 0.0, 1.0}, 0.4, 0.2, distance);
    RenderOptions options = Bare();
    options.supersampling = 1;
    const View view(camera, options.width, options.height);
    const RenderItem item{&sphere, {0.2, 0.2, 0.2}, nullptr};
    const double radius = view.Focal() * 0.25 / std::sqrt(distance * distance - 0.0625);
    const double expected = std::numbers::pi * radius * radius;
    EXPECT_NEAR(CountDrawn(Render({&item, 1}, camera, options)), expected, 0.02 * expected);
  }
}

TEST(Render, NearerHidesFartherInEitherOrder) {
  const TriangleMesh near = Sphere({0.0, -1.0, 1.0}, 0.2);
  const TriangleMesh far = Sphere({0.0, 1.0, 1.0}, 0.2);
  const RenderItem red{&near, {0.8, 0.1, 0.1}, nullptr};
  const RenderItem blue{&far, {0.1, 0.1, 0.8}, nullptr};
  const Camera camera = OrbitCamera({0.0, 0.0, 1.0}, 0.0, 0.0, 4.0);
  for (const auto& items : {std::vector{red, blue}, std::vector{blue, red}}) {
    const Image image = Render(items, camera, Bare());
    EXPECT_TRUE(Reddish(image.Pixel(160, 120)));
    for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
      EXPECT_FALSE(Bluish(&image.rgb[i])) << "the far sphere is wholly behind the near one";
    }
  }
}

TEST(Render, IntersectingSurfacesMeetWhereTheyCross) {
  // Two slanted walls crossing in the plane x = 0: left of it the red one is in front.
  TriangleMesh a = Triangle({-1, -0.5, -1}, {1, 0.5, -1}, {0, 0, 3});
  TriangleMesh b = Triangle({-1, 0.5, -1}, {1, -0.5, -1}, {0, 0, 3});
  const std::vector<RenderItem> items = {{&a, {0.8, 0.1, 0.1}, nullptr},
                                         {&b, {0.1, 0.1, 0.8}, nullptr}};
  const Image image = Render(items, OrbitCamera({0, 0, 0}, 0.0, 0.0, 5.0), Bare());
  EXPECT_TRUE(Reddish(image.Pixel(152, 125)));
  EXPECT_TRUE(Bluish(image.Pixel(168, 125)));
}

TEST(Render, VertexColorsReplaceTheColor) {
  const TriangleMesh sphere = Sphere({0, 0, 1}, 0.3);
  Eigen::Matrix3Xd colors(3, sphere.NumVertices());
  colors.colwise() = Eigen::Vector3d(0.1, 0.1, 0.8);
  const RenderItem item{&sphere, {0.8, 0.1, 0.1}, &colors};
  const Image image = Render({&item, 1}, OrbitCamera({0, 0, 1}, 0, 0, 3.0), Bare());
  EXPECT_TRUE(Bluish(image.Pixel(160, 120)));
}

TEST(Render, GroundLiesUnderAndShadowFalls) {
  const TriangleMesh sphere = Sphere({0, 0, 0.3}, 0.25);
  const RenderItem item{&sphere, {0.5, 0.5, 0.5}, nullptr};
  RenderOptions options = Bare();
  options.ground = true;
  options.grid_spacing_m = 0.0;
  const Camera camera = OrbitCamera({0, 0, 0.2}, 0, 0.5, 3.0);
  const Image lit = Render({}, camera, options);
  const Image shadowed = Render({&item, 1}, camera, options);
  // Below the sphere in the picture, on the side away from the light (which comes from the left).
  const View view(camera, options.width, options.height);
  const Eigen::Vector2d at = view.Project(view.ToCamera({0.15, -0.05, 0.0}));
  const int x = static_cast<int>(at.x());
  const int y = static_cast<int>(at.y());
  EXPECT_LT(shadowed.Pixel(x, y)[0], lit.Pixel(x, y)[0] - 20);
}

TEST(Render, OneMeshShadesAnother) {
  // A ball towards the key light (above the viewer's left shoulder) darkens the one behind it; the
  // same ball on the other side does not.
  const TriangleMesh ball = Sphere({0, 0, 1}, 0.2);
  const TriangleMesh blocker = Sphere({-0.45, -0.27, 1.54}, 0.12);
  const TriangleMesh bystander = Sphere({0.45, -0.27, 1.54}, 0.12);
  const Camera camera = OrbitCamera({0, 0, 1}, 0, 0, 3.0);
  const auto brightness = [&](const TriangleMesh& other) {
    const std::vector<RenderItem> items = {{&ball, {0.6, 0.6, 0.6}, nullptr},
                                           {&other, {0.6, 0.6, 0.6}, nullptr}};
    const Image image = Render(items, camera, Bare());
    int sum = 0;
    for (int y = 94; y < 108; ++y) {
      for (int x = 138; x < 152; ++x) sum += image.Pixel(x, y)[1];
    }
    return sum / (14 * 14);
  };
  EXPECT_LT(brightness(blocker), brightness(bystander) - 15);
}

TEST(ShadowMap, LitSurfacesDoNotShadeThemselves) {
  const TriangleMesh sphere = Sphere({0, 0, 0}, 0.5, 24);
  const TriangleMesh* const meshes[] = {&sphere};
  const Eigen::Vector3d to_light = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
  const Eigen::Matrix3Xd normals = VertexNormals(sphere);
  for (const double finest : {0.0, 0.003}) {
    const ShadowMap shadows(meshes, to_light, finest);
    for (Eigen::Index v = 0; v < sphere.NumVertices(); ++v) {
      const Eigen::Vector3d normal = normals.col(v);
      if (normal.dot(to_light) < 0.3) continue;
      EXPECT_GT(shadows.Light(sphere.vertices.col(v), normal), 0.99f);
    }
    // Beneath the sphere, facing the light, it is dark.
    EXPECT_LT(shadows.Light(-0.8 * to_light, to_light), 0.5f);
  }
}

TEST(Render, SameSceneGivesTheSameBytes) {
  const TriangleMesh sphere = Sphere({0, 0, 0.5}, 0.4);
  const RenderItem item{&sphere, {0.6, 0.5, 0.4}, nullptr};
  RenderOptions options;
  options.width = 200;
  options.height = 150;
  const Camera camera = OrbitCamera({0, 0, 0.5}, 0.3, 0.3, 2.5);
  const std::string first = EncodePng(Render({&item, 1}, camera, options));
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(EncodePng(Render({&item, 1}, camera, options)), first);
  }
}

TEST(Render, HostileTrianglesAreLeftOut) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d p(0, 0, 1);
  const std::vector<TriangleMesh> meshes = {
      Triangle(p, p, p),                                      // a point
      Triangle(p, p + Eigen::Vector3d::UnitX(), p),           // a line
      Triangle({kNan, 0, 0}, {1, 0, 0}, {0, 0, 1}),           // not a number
      Triangle({kInf, 0, 0}, {1, 0, 0}, {0, 0, 1}),           // infinite
      Triangle({100, 0, 0}, {101, 0, 0}, {100, 0, 1}),        // off the picture
      Triangle({0, -10, 0}, {1, -10, 0}, {0, -10, 1}),        // behind the camera
      Triangle({0, -3, -1e-9}, {0, -3, 0}, {1e-300, -3, 0}),  // at the eye
      TriangleMesh{}};
  for (const TriangleMesh& mesh : meshes) {
    const RenderItem item{&mesh, {0.1, 0.1, 0.1}, nullptr};
    Camera camera;
    camera.eye = {0.0, -3.0, 0.0};
    camera.target = Eigen::Vector3d::Zero();
    Image image;
    ASSERT_NO_THROW(image = Render({&item, 1}, camera, Bare()));
    EXPECT_EQ(CountDrawn(image), 0);
    RenderOptions with_ground = Bare();
    with_ground.ground = true;
    EXPECT_NO_THROW(Render({&item, 1}, camera, with_ground));
  }
}

TEST(Render, HugeTrianglesAreCutAtTheNearPlane) {
  // A floor from far behind the camera to far ahead covers exactly what is below the horizon.
  for (const double size : {1e4, 1e6, 1e9}) {
    const TriangleMesh floor = Triangle({-size, -size, 0}, {size, -size, 0}, {0, size, 0});
    const RenderItem item{&floor, {0.1, 0.1, 0.1}, nullptr};
    Camera camera;
    camera.eye = {0.0, 0.0, 0.5};
    camera.target = {0.0, 1.0, 0.5};
    const Image image = Render({&item, 1}, camera, Bare());
    EXPECT_EQ(image.Pixel(160, 10)[0], 255);
    EXPECT_LT(image.Pixel(160, 200)[0], 200);
    EXPECT_NEAR(CountDrawn(image), 320 * 120, 0.02 * 320 * 120);
  }
}

TEST(Render, RefusesWhatMakesNoSense) {
  TriangleMesh mesh = Triangle({0, 0, 0}, {1, 0, 0}, {0, 0, 1});
  RenderItem item{&mesh, {0.5, 0.5, 0.5}, nullptr};
  const Camera camera;
  RenderOptions options = Bare();
  options.supersampling = 9;
  EXPECT_THROW(Render({&item, 1}, camera, options), Error);
  options = Bare(0, 10);
  EXPECT_THROW(Render({&item, 1}, camera, options), Error);
  mesh.faces(2, 0) = 3;
  EXPECT_THROW(Render({&item, 1}, camera, Bare()), Error);
  mesh.faces(2, 0) = 2;
  const Eigen::Matrix3Xd two_colors = Eigen::Matrix3Xd::Zero(3, 2);
  item.vertex_colors = &two_colors;
  EXPECT_THROW(Render({&item, 1}, camera, Bare()), Error);
  Camera blind;
  blind.target = blind.eye;
  item.vertex_colors = nullptr;
  EXPECT_THROW(Render({&item, 1}, blind, Bare()), Error);
}

TEST(TriangleScan, FansTileWithoutGapsOrOverlap) {
  // A disc cut into slivers around an off-center hub: every sample inside is visited exactly once.
  constexpr int kSize = 64;
  std::vector<int> visits(kSize * kSize, 0);
  const Eigen::Vector2d hub(20.3, 41.7);
  const auto rim = [](int k) {
    const double angle = 2.0 * std::numbers::pi * k / 101;
    return Eigen::Vector2d(32 + 40 * std::cos(angle), 32 + 40 * std::sin(angle));
  };
  for (int k = 0; k < 101; ++k) {
    ScanTriangle({hub, rim(k), rim((k + 1) % 101)}, kSize, kSize,
                 [&](int x, int y) { ++visits[y * kSize + x]; });
  }
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double radius = (Eigen::Vector2d(x + 0.5, y + 0.5) - Eigen::Vector2d(32, 32)).norm();
      if (radius < 39.9) {
        EXPECT_EQ(visits[y * kSize + x], 1) << x << ' ' << y;
      }
    }
  }
}

TEST(Camera, FittedBoxIsInsideThePictureAndFillsIt) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.4, -0.3, 0.0), Eigen::Vector3d(0.5, 0.2, 1.7));
  for (const double azimuth : {-2.0, 0.0, 0.7, 3.0}) {
    for (const double elevation : {-1.2, 0.0, 0.4, 0.5 * std::numbers::pi}) {
      for (const auto& [width, height] : {std::pair{640, 480}, std::pair{300, 600}}) {
        const double aspect = static_cast<double>(width) / height;
        const View view(FitCamera(box, azimuth, elevation, aspect), width, height);
        double reach = 0.0;
        for (int k = 0; k < 8; ++k) {
          const Eigen::Vector2d p = view.Project(
              view.ToCamera(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k))));
          reach = std::max({reach, std::abs(p.x() / width - 0.5), std::abs(p.y() / height - 0.5)});
        }
        EXPECT_LE(reach, 0.5);
        EXPECT_GE(reach, 0.45);
      }
    }
  }
}

TEST(Png, RoundTripIsExact) {
  Image image(37, 23);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    image.rgb[i] = static_cast<std::uint8_t>((i * 2654435761u) >> 13);
  }
  const Image back = DecodePng(EncodePng(image));
  EXPECT_EQ(back.width, image.width);
  EXPECT_EQ(back.height, image.height);
  EXPECT_EQ(back.rgb, image.rgb);
}

TEST(Png, DamagedBytesThrow) {
  const std::string bytes = EncodePng(Image(8, 8));
  EXPECT_THROW(DecodePng(""), Error);
  EXPECT_THROW(DecodePng("PNG?"), Error);
  EXPECT_THROW(DecodePng(bytes.substr(0, bytes.size() / 2)), Error);
  EXPECT_THROW(EncodePng(Image{}), Error);
}

TEST(ContactSheet, TilesKeepTheirPixels) {
  std::vector<Image> tiles;
  for (int t = 0; t < 5; ++t) {
    tiles.emplace_back(40, 30);
    for (auto& byte : tiles.back().rgb) byte = static_cast<std::uint8_t>(50 * t);
  }
  const Image sheet = ContactSheet(tiles, {}, 3);
  EXPECT_EQ(sheet.width, 3 * 42 - 2);
  EXPECT_EQ(sheet.height, 2 * 32 - 2);
  for (int t = 0; t < 5; ++t) {
    EXPECT_EQ(sheet.Pixel(t % 3 * 42 + 20, t / 3 * 32 + 25)[1], 50 * t);
  }
  EXPECT_THROW(ContactSheet({}, {}, 3), Error);
  EXPECT_THROW(ContactSheet(tiles, {}, 0), Error);
}

TEST(Label, EveryGlyphIsDistinctAndCutOffAtTheBorder) {
  const std::string known = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ .,:;-+/_=%()#<>*'";
  std::vector<std::vector<std::uint8_t>> seen;
  for (const char character : known + "@") {
    Image image(5, 7);
    std::fill(image.rgb.begin(), image.rgb.end(), std::uint8_t{255});
    DrawLabel(image, 0, 0, std::string(1, character));
    EXPECT_THAT(seen, ::testing::Not(::testing::Contains(image.rgb))) << character;
    seen.push_back(image.rgb);
  }
  Image small(3, 3);
  EXPECT_NO_THROW(DrawLabel(small, -50, -2, "clipped on every side", 2));
}

}  // namespace
}  // namespace holdfast
