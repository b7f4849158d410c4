// SPDX-License-Identifier: MIT
#include "geometry/io/mesh/gltf_mesh.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// One triangle in each of five materials that share one large image.
json SharedImage(const std::string& image) {
  // Three float vectors: 0 0 0, 1 0 0, 0 1 0.
  const std::string positions = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
  json file = {
      {"asset", {{"version", "2.0"}}},
      {"buffers",
       {{{"byteLength", 36}, {"uri", "data:application/octet-stream;base64," + positions}}}},
      {"bufferViews", {{{"buffer", 0}, {"byteLength", 36}}}},
      {"accessors", {{{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}}}},
      {"images", {{{"uri", image}}}},
      {"textures", {{{"source", 0}}}},
      {"materials", json::array()},
      {"meshes", {{{"primitives", json::array()}}}}};
  for (int k = 0; k < 5; ++k) {
    file["materials"].push_back({{"name", "m" + std::to_string(k)},
                                 {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
    file["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"material", k}});
  }
  return file;
}

TEST(GltfLook, BoundsWhatImagesTakeTogether) {
  const testing::TemporaryFolder folder;
  std::ofstream(folder / "large.png", std::ios::binary) << "\x89PNG\r\n\x1a\n";
  std::filesystem::resize_file(folder / "large.png", std::uintmax_t{100} << 20);
  const GltfAsset asset =
      GltfAsset::Parse(SharedImage("large.png").dump(), "shared.gltf", folder.Path());
  const auto look = ReadGltfLook(asset, 0);
  ASSERT_TRUE(look);
  ASSERT_EQ(look->materials.size(), 5u);
  for (int k = 0; k < 5; ++k) EXPECT_EQ(look->materials[k].image.empty(), k > 1) << k;
  EXPECT_EQ(look->parts.size(), 5u);
  EXPECT_THAT(look->notes, ElementsAre(HasSubstr("the image of 'm2' and those after it")));
}

}  // namespace
}  // namespace holdfast
