// SPDX-License-Identifier: MIT
#include "geometry/suggestion.h"

#include <gtest/gtest.h>

namespace holdfast {
namespace {

TEST(Suggestion, EditDistanceIsThatOfKnownPairs) {
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3);
  EXPECT_EQ(EditDistance("", "abc"), 3);
  EXPECT_EQ(EditDistance("ab", "ba"), 1);
  EXPECT_EQ(EditDistance("mug", "mug"), 0);
}

TEST(Suggestion, IsTheNearestNameOrNone) {
  EXPECT_EQ(Suggestion("bottel", {"mug", "bottle"}), "Did you mean 'bottle'? ");
  EXPECT_EQ(Suggestion("xylophone", {"mug", "bottle"}), "");
  EXPECT_EQ(Suggestion("mug", {}), "");
}

}  // namespace
}  // namespace holdfast
