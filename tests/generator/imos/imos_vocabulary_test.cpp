// SPDX-License-Identifier: MIT
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/imos/config.h"
#include "generator/imos/vocabulary.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "tests/support/error_text.h"

namespace holdfast::imos {
namespace {

using holdfast::testing::ErrorText;
using ::testing::HasSubstr;

std::string_view Label(const Intent& intent) { return Actions()[intent.action].label; }
std::string_view Object(const Intent& intent) { return Objects()[intent.object]; }

TEST(Vocabulary, IdsAreThePublishedOnes) {
  EXPECT_EQ(Actions()[0].label, "offhand");
  EXPECT_EQ(Actions()[3].label, "drink");
  EXPECT_EQ(Actions()[16].label, "switchON");
  EXPECT_EQ(Actions()[28].label, "stamp");
  EXPECT_EQ(Objects()[1], "mug");
  EXPECT_EQ(Objects()[42], "waterbottle");
  EXPECT_EQ(Objects()[53], "toothbrush");
  std::set<std::string_view> labels, objects(Objects().begin(), Objects().end());
  for (const Action& action : Actions()) labels.insert(action.label);
  EXPECT_EQ(labels.size(), 29u);
  EXPECT_EQ(objects.size(), 54u);
}

TEST(Vocabulary, EveryNameIsFoundAndEverySentenceIsUnderstood) {
  for (int a = 0; a < kNumActions; ++a) {
    EXPECT_EQ(FindAction(Actions()[a].label), a) << Actions()[a].label;
    EXPECT_EQ(FindAction(Actions()[a].verb), a) << Actions()[a].verb;
    for (int o = 0; o < kNumObjects; ++o) {
      const Intent intent = ParseSentence(SentenceOf({a, o}));
      EXPECT_EQ(intent.action, a) << SentenceOf({a, o});
      EXPECT_EQ(intent.object, o) << SentenceOf({a, o});
    }
  }
  for (int o = 0; o < kNumObjects; ++o) EXPECT_EQ(FindObject(Objects()[o]), o);
}

TEST(Vocabulary, SentencesAsPeopleSayThem) {
  const auto expect = [](const char* sentence, const char* action, const char* object) {
    const Intent intent = ParseSentence(sentence);
    EXPECT_EQ(Label(intent), action) << sentence;
    EXPECT_EQ(Object(intent), object) << sentence;
  };
  expect("The person drinks from the mug", "drink", "mug");
  expect("drink mug", "drink", "mug");
  expect("Somebody is pouring tea out of a teapot.", "pour", "teapot");
  expect("she takes a picture with the camera", "takepicture", "camera");
  expect("He photographs his duck with a camera", "takepicture", "camera");
  expect("pass the small sphere to a partner", "pass", "spheresmall");
  expect("a person using the frying pan", "use", "fryingpan");
  expect("brush teeth with the tooth brush", "brush", "toothbrush");
  expect("calls on the phone", "call", "phone");
  expect("stamp with the stamp", "stamp", "stamp");
  expect("setting the alarm-clock", "set", "alarmclock");
  expect("She hands over the bottle", "pass", "waterbottle");
  expect("switches on the flashlight", "switchON", "flashlight");
}

TEST(Vocabulary, FreeSentencesMeanTheNearestAction) {
  const auto expect = [](const char* sentence, const char* action, const char* words) {
    const ParsedSentence parsed = ParseSentence(sentence);
    EXPECT_EQ(Label(parsed), action) << sentence;
    EXPECT_EQ(parsed.because, words) << sentence;
  };
  expect("raise the cup and take a sip", "drink", "sip");
  expect("lift the cup and take a sip", "drink", "sip");
  expect("inspect the apple, then bite and chew it", "eat", "bite, chew");
  expect("somebody picks up the mug", "lift", "picks up");
  expect("he is slicing a banana with the knife", "chop", "slicing");
  expect("give the camera to a friend", "pass", "give");
  expect("dials with the phone", "call", "");
  expect("inspects the camera", "inspect", "");
  const std::array<std::string_view, 2> offered{"lift", "pour"};
  EXPECT_EQ(Label(ParseSentence("raise the cup and take a sip", offered)), "lift");
  EXPECT_EQ(ParseSentence("raise it and take a sip", {}, {}, std::nullopt, 7).object, 7);
  EXPECT_EQ(ParseSentence("do as usual with the mug", {}, {}, 3).action, 3);
  const std::vector<std::string> all{"use", "drink"};
  EXPECT_EQ(SimilarAction(*FindAction("staple"), all), FindAction("use"));
  EXPECT_EQ(SimilarAction(*FindAction("see"), all), FindAction("drink"));
  EXPECT_EQ(SimilarAction(*FindAction("peel"), all), std::nullopt);
}

TEST(Vocabulary, UnknownNamesSuggestTheNearest) {
  EXPECT_THAT(ErrorText([] { ActionId("drnik", "--action"); }),
              HasSubstr("--action: there is no action 'drnik'. Did you mean 'drink'?"));
  const std::string error = ErrorText([] { ObjectId("weinglass"); });
  EXPECT_THAT(error, HasSubstr("Did you mean 'wineglass'?"));
  EXPECT_THAT(error, HasSubstr("mug, elephant"));  // and lists all
  EXPECT_THAT(ErrorText([] { ActionId("xylophonically"); }), Not(HasSubstr("Did you mean")));
  EXPECT_THAT(ErrorText([] { ParseSentence("the person swims with the mug"); }),
              HasSubstr("none of its words is a known action"));
  EXPECT_THAT(ErrorText([] { ParseSentence("the person drinks from the zeppelin"); }),
              HasSubstr("none of its words is a known object"));
  EXPECT_THAT(ErrorText([] { ParseSentence("drink from the binocculars"); }),
              HasSubstr("Did you mean 'binoculars'?"));
  EXPECT_THAT(ErrorText([] { ParseSentence(" ... "); }), HasSubstr("no word"));
}

TEST(Vocabulary, EmbeddedMeshesAreInIt) {
  EXPECT_EQ(EmbeddedMeshName("waterbottle"), "bottle");
  EXPECT_EQ(EmbeddedMeshName("mug"), "mug");
  EXPECT_EQ(VocabularyName("cube"), "cubemedium");
  EXPECT_EQ(VocabularyName("mug"), "mug");
  int meshes = 0;
  for (const EmbeddedFile& file : EmbeddedFiles()) {
    constexpr std::string_view kFolder = "objects/", kEnd = ".ply", kSmall = "_300.ply";
    if (!file.name.starts_with(kFolder) || !file.name.ends_with(kEnd)) continue;
    if (file.name.ends_with(kSmall)) continue;
    const std::string_view name =
        file.name.substr(kFolder.size(), file.name.size() - kFolder.size() - kEnd.size());
    EXPECT_TRUE(FindObject(VocabularyName(name))) << name;
    EXPECT_EQ(EmbeddedMeshName(VocabularyName(name)), name);
    ++meshes;
  }
  EXPECT_GT(meshes, 10);
}

}  // namespace
}  // namespace holdfast::imos
