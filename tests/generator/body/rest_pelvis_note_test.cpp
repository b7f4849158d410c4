// SPDX-License-Identifier: MIT
#include "generator/body/rest_pelvis_note.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/imos/synthesis_network.h"
#include "generator/wandr/network.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;

TEST(OldPelvisWarning, IsOfNetworksThatHoldfastTrainedBefore) {
  std::map<std::string, std::string> notes;
  EXPECT_FALSE(OldPelvisWarning("a.safetensors", notes));  // published: of SMPL-X
  notes["made_by"] = "holdfast train wandr 0.1.0";
  const auto old = OldPelvisWarning("a.safetensors", notes);
  ASSERT_TRUE(old);
  EXPECT_THAT(*old, HasSubstr("a.safetensors: was trained with"));
  EXPECT_THAT(*old, HasSubstr("Train it again ('python3 -m holdfast.train wandr')"));
  NoteRestPelvis(notes);
  EXPECT_FALSE(OldPelvisWarning("a.safetensors", notes));
  notes["rest_pelvis"] = "0,0,0";
  EXPECT_TRUE(OldPelvisWarning("a.safetensors", notes));
}

TEST(OldPelvisWarning, EmbeddedNetworksAreOfToday) {
  if (wandr::HasDefaultNetwork()) {
    EXPECT_FALSE(OldPelvisWarning("", wandr::DefaultNetwork().notes));
    EXPECT_TRUE(wandr::DefaultNetwork().notes.contains("rest_pelvis"));
  }
  if (imos::HasDefaultNetwork()) {
    EXPECT_FALSE(OldPelvisWarning("", imos::DefaultNetwork().notes));
    EXPECT_TRUE(imos::DefaultNetwork().notes.contains("rest_pelvis"));
  }
}

}  // namespace
}  // namespace holdfast
