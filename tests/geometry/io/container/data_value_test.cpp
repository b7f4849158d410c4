// SPDX-License-Identifier: MIT
#include "geometry/io/container/data_value.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <thread>

#include "geometry/io/container/data_store.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/pickle/pickle.h"
#include "tests/support/error_text.h"
#include "tests/support/pickle_files.h"

namespace holdfast {
namespace {

using ::testing::ElementsAre;
using testing::ErrorText;
using ::testing::HasSubstr;
using testing::ReadPickleText;

DataValue Plain() { return testing::ReadPickleFile(testing::PickleFixtures() / "plain_p4.pkl"); }

TEST(DataValue, NamesWhereItComesFromAndWhatThereIs) {
  const DataValue file = ReadPickleText("(dVbody\n(dVpose\n(I1\nI2\nlsVname\nVs1\nss.");
  EXPECT_TRUE(file.Has("body"));
  EXPECT_FALSE(file.Has("bod"));
  EXPECT_FALSE(file["body"]["pose"].Has("x"));
  EXPECT_FALSE(file.Find("hands").has_value());
  EXPECT_EQ(file["body"]["pose"][1].Where(), "x.pkl[body][pose][1]");
  EXPECT_THAT(ErrorText([&] { file["body"]["hands"]; }),
              HasSubstr("x.pkl[body][hands]: is missing. It has: pose, name"));
  EXPECT_THAT(ErrorText([&] { file["body"]["pose"]["x"]; }),
              HasSubstr("x.pkl[body][pose]: is list of 2, where named values with 'x' are needed"));
  EXPECT_THAT(ErrorText([&] { file["body"]["pose"][2]; }),
              HasSubstr("has 2 items, but item 2 was requested"));
  EXPECT_THAT(ErrorText([&] { file[std::size_t{0}]; }), HasSubstr("where a list is needed"));
  EXPECT_THAT(ErrorText([&] { file["body"]["name"].Array(); }),
              HasSubstr("is not an array of numbers"));
  EXPECT_THAT(ErrorText([&] { file["body"]["name"].Number(); }), HasSubstr("[body][name]: "));
  EXPECT_THAT(ErrorText([&] { file["body"].Text(); }), HasSubstr("where a text is needed"));
}

TEST(DataValue, SaysWhatItIs) {
  const DataValue file = Plain();
  EXPECT_EQ(file["none"].Describe(), "None");
  EXPECT_EQ(file["integers"][5].Describe(), "65536");
  EXPECT_EQ(file["reals"][2].Describe(), "1.5");
  EXPECT_EQ(file["texts"][1].Describe(), "text \"plain\"");
  EXPECT_LT(file["texts"][4].Describe().size(), 70u);
  EXPECT_EQ(file["bytes"][2].Describe(), "256 bytes");
  EXPECT_EQ(file["rows"].Describe(), "list of 2");
  EXPECT_EQ(file["ordered"].Describe(), "dict of 2");
  EXPECT_EQ(file["strided"].Describe(), "array (2, 4) of float64");
  EXPECT_EQ(file["namespace"].Describe(), "argparse.Namespace");
}

TEST(DataValue, ListsOfEqualLengthAreArrays) {
  const DataValue file = Plain();
  const NpyMember rows = file["rows"].Array();
  EXPECT_EQ(rows.array.kind, 'i');
  EXPECT_THAT(rows.array.shape, ElementsAre(2u, 3u));
  EXPECT_THAT(rows.AsIntegers(), ElementsAre(1, 2, 3, 4, 5, 6));
  const NpyMember mixed = file["mixed_rows"].Array();
  EXPECT_EQ(mixed.array.kind, 'f');
  EXPECT_THAT(mixed.AsDoubles(), ElementsAre(1, 2.5, 1, 4));
  const NpyMember joined = file["array_rows"].Array();
  EXPECT_THAT(joined.array.shape, ElementsAre(2u, 2u));
  EXPECT_THAT(joined.AsDoubles(), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(file["empty_rows"].Array().array.shape, ElementsAre(2u, 0u));
  EXPECT_THAT(ErrorText([&] { file["uneven"].Array(); }),
              HasSubstr("[uneven]: holds lists of unequal"));
  EXPECT_THAT(ErrorText([&] { file["no_numbers"].Array(); }),
              HasSubstr("values that are not numbers"));
  EXPECT_TRUE(file["rows"].HoldsNumbers());
  EXPECT_FALSE(file["uneven"].HoldsNumbers());
  EXPECT_FALSE(file["no_numbers"].HoldsNumbers());
  EXPECT_FALSE(file["namespace"].HoldsNumbers());
  EXPECT_FALSE(file["none"].HoldsNumbers());
}

TEST(DataValue, NumbersAreOneAndWholeWhereThatIsAskedFor) {
  const DataValue file = Plain();
  EXPECT_EQ(file["integers"][13].Integer(), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(file["reals"][0].Integer(), 0);
  EXPECT_THAT(ErrorText([&] { file["reals"][2].Integer(); }),
              HasSubstr("is 1.5, where a whole number"));
  EXPECT_THAT(ErrorText([&] { file["reals"][5].Integer(); }), HasSubstr("is inf, where a whole"));
  EXPECT_THAT(ErrorText([&] { file["nan"].Integer(); }), HasSubstr("is nan, where a whole"));
  EXPECT_THAT(ErrorText([&] { file["rows"].Number(); }),
              HasSubstr("has shape (2, 3), where one number"));
}

TEST(DataValue, LastHandleGivesItsBytesAway) {
  NpyArray array{'f', 4, false, false, {1000}, std::vector<std::byte>(4000)};
  const std::byte* data = array.data.data();
  DataValue first = ArrayValue(std::move(array), "big.npy");
  const DataValue second = first;
  EXPECT_NE(std::move(first).Array().array.data.data(), data);  // another handle still needs them
  DataValue third = second;
  {
    const DataValue dropped = std::move(third);
    EXPECT_EQ(dropped.Array().array.data.size(), 4000u);
  }
  NpyArray alone{'f', 4, true, true, {10, 100}, std::vector<std::byte>(4000)};
  data = alone.data.data();
  const NpyMember member = ArrayValue(std::move(alone), "big.npy").Array();
  EXPECT_EQ(member.array.data.data(), data);
  EXPECT_THAT(member.array.shape, ElementsAre(10u, 100u));
  EXPECT_TRUE(member.array.big_endian);
  EXPECT_TRUE(member.array.fortran_order);
  EXPECT_EQ(member.where, "big.npy");
}

TEST(DataValue, ViewsObeyTheirStrides) {
  auto store = std::make_shared<DataStore>("views", std::size_t{1} << 20);
  std::vector<std::byte> bytes(12);
  for (std::size_t i = 0; i < 12; ++i) bytes[i] = static_cast<std::byte>(i);
  const DataBytes owned = OwnBytes(bytes);
  store->Keep(owned.owner);
  const auto view = [&](std::vector<std::size_t> shape, std::vector<std::size_t> strides) {
    ArrayNode array;
    array.element = {'u', 1, false};
    array.shape = std::move(shape);
    array.strides = std::move(strides);
    array.bytes = owned.view;
    return DataValue(store, store->AddArray(std::move(array)), "view");
  };
  EXPECT_THAT(view({3, 2}, {1, 6}).Array().AsIntegers(), ElementsAre(0, 6, 1, 7, 2, 8));
  EXPECT_THAT(view({2, 3}, {5, 0}).Array().AsIntegers(), ElementsAre(0, 0, 0, 5, 5, 5));
  EXPECT_THAT(view({0, 3}, {5, 7}).Array().AsIntegers(), ElementsAre());
  EXPECT_THAT(ErrorText([&] {
                view({1u << 31, 1u << 31}, {0, 0}).Array();
              }),
              HasSubstr("more bytes than there are"));
}

TEST(DataValue, BrainFloatsBecomeFloats) {
  auto store = std::make_shared<DataStore>("b", std::size_t{1} << 20);
  NpyArray array{'B', 2, false, false, {3}, {}};
  for (const int byte : {0x80, 0x3f, 0x20, 0xc0, 0x80, 0x7f}) {
    array.data.push_back(static_cast<std::byte>(byte));
  }
  const DataValue value(store, store->AddArray(std::move(array)), "b");
  EXPECT_EQ(value.Describe(), "array (3) of bfloat16");
  EXPECT_THAT(value.Array().AsFloats(),
              ElementsAre(1.0f, -2.5f, std::numeric_limits<float>::infinity()));
}

TEST(DataValue, OfEntriesWithOneNameTheLastCounts) {
  const DataValue file =
      ReadPickleText("(dVa\nI1\nsVb\nI2\nsVa\nI3\nsI7\nI4\nsV7\nI5\nsS'b'\nI6\ns.");
  EXPECT_THAT(file.Names(), ElementsAre("a", "b", "7"));
  EXPECT_EQ(file["a"].Integer(), 3);
  EXPECT_EQ(file["b"].Integer(), 6);
  EXPECT_EQ(file["7"].Integer(), 5);
}

TEST(DataValue, AgreesWithAMapOnAnyNames) {
  std::string text = "(d";
  std::set<std::string> names;
  for (int i = 0; i < 3000; ++i) {
    const std::string name = std::string("n").append(std::to_string(i * 7919 % 1013));
    text += "V" + name + "\nI" + std::to_string(i) + "\ns";
    names.insert(name);
  }
  const DataValue file = ReadPickleText(text + ".");
  EXPECT_EQ(file.Names().size(), names.size());
  for (const std::string& name : names) EXPECT_TRUE(file.Has(name));
  EXPECT_FALSE(file.Has("n"));
  EXPECT_EQ(file["n0"].Integer(), 2026);  // 0, 1013 and 2026 times 7919 are multiples of 1013
}

TEST(DataValue, TextsOfPython2AreTextsWhereTheyCanBe) {
  const DataValue file = ReadPickleText("(dVutf8\nS'Gr\\xc3\\xb6\\xc3\\x9fe'\nsVraw\nS'\\xff'\ns.");
  EXPECT_EQ(file["utf8"].Kind(), DataKind::kText);
  EXPECT_EQ(file["utf8"].Text(), "Größe");
  EXPECT_EQ(file["raw"].Kind(), DataKind::kBytes);
}

TEST(DataValue, MayBeReadFromManyThreads) {
  const DataValue file = Plain();
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([file] {
      for (int i = 0; i < 200; ++i) EXPECT_EQ(file["rows"].Array().AsIntegers()[5], 6);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST(DataStore, ChargesBeforeItGrows) {
  DataStore store("small", 4096);
  EXPECT_THAT(ErrorText([&] { store.Charge(5000); }), HasSubstr("small: would take more than"));
  EXPECT_THAT(ErrorText([&] {
                for (int i = 0; i < 1000; ++i) store.AddInteger(i);
              }),
              HasSubstr("would take more than"));
  EXPECT_EQ(DataStore::DefaultLimit(1000), 10000u + (std::size_t{64} << 20));
  EXPECT_EQ(DataStore::DefaultLimit(SIZE_MAX / 2), SIZE_MAX);
}

// Names of files, markers and joints may be any bytes.
TEST(JsonText, IsUtf8WhateverBytesItHolds) {
  const nlohmann::json json = {{"h\xfc"
                                "fte",
                                {"w\xe4lk.c3d", 3, {{"b", "\xed\xa0\x80"}}}},
                               {"plain", "Gr\u00f6\u00dfe"}};
  EXPECT_EQ(
      JsonText(json),
      "{\"h\u00fc"
      "fte\":[\"w\u00e4lk.c3d\",3,{\"b\":\"\ufffd\ufffd\ufffd\"}],\"plain\":\"Gr\u00f6\u00dfe\"}");
  EXPECT_EQ(JsonText(nlohmann::json{{"a", 1}}, 1), "{\n \"a\": 1\n}");
  EXPECT_EQ(AsUtf8("Gr\xc3\xb6\xc3\x9f"
                   "e"),
            "Gr\u00f6\u00dfe");
}

TEST(Utf8, IsWhatTheStandardAllowsAndPythonsSurrogates) {
  for (const char* good : {"", "a", "\xc2\x80", "\xdf\xbf", "\xe0\xa0\x80", "\xef\xbf\xbf",
                           "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf", "\xed\xa0\x80"}) {
    EXPECT_TRUE(IsUtf8(good)) << good;
  }
  for (const char* bad : {"\x80", "\xc0\x80", "\xc1\xbf", "\xc2", "\xc2\x41", "\xe0\x9f\xbf",
                          "\xe1\x80", "\xf0\x8f\xbf\xbf", "\xf4\x90\x80\x80", "\xf5\x80\x80\x80"}) {
    EXPECT_FALSE(IsUtf8(bad)) << bad;
  }
}

}  // namespace
}  // namespace holdfast
