// SPDX-License-Identifier: MIT
#include "solver/robot/contact_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/json_file.h"
#include "solver/hand/hand_axes.h"
#include "solver/hand/hand_landmarks.h"

namespace holdfast {
namespace {

constexpr const char* kSchema = "holdfast/contacts/1";
constexpr double kMoved_m = 5e-4, kMaxOff_m = 0.02;

// A contact that stays where it is for some frames.
struct Stay {
  int first, last;
  PartContact contact;
};

Eigen::Vector3d VectorOf(const nlohmann::json& json) {
  const auto values = json.get<std::array<double, 3>>();
  return Eigen::Vector3d(values.data());
}

nlohmann::json Rounded(const Eigen::Vector3d& v) {
  nlohmann::json values;
  for (const double x : v) values.push_back(std::round(1e7 * x) / 1e7);
  return values;
}

// Reads an entry of a file; `where` names it.
Stay StayOf(const nlohmann::json& entry, const std::string& where, int frames,
            const SignedDistance& object) {
  Stay stay;
  const std::string part = entry.at("part").get<std::string>();
  stay.contact.part = ParseHandPart(part);
  if (stay.contact.part < 0) {
    throw Error(where, fmt::format("has the unknown part '{}'", part),
                "Use the parts palm, thumb1 ... thumb3, index1 ... pinky3");
  }
  const auto range = entry.at("frames").get<std::array<int, 2>>();
  stay.first = range[0];
  stay.last = range[1];
  if (stay.first < 0 || stay.last < stay.first || stay.last >= frames) {
    throw Error(where, fmt::format("has the frames {} to {}", stay.first, stay.last),
                fmt::format("Give the first and the last frame, within 0 to {}", frames - 1));
  }
  const Eigen::Vector3d given = VectorOf(entry.at("point"));
  if (!given.allFinite())
    throw Error(where, "has a point that is not finite", "Give three numbers");
  const SignedDistance::Result on = object.Query(given);
  if (std::abs(on.distance) > kMaxOff_m) {
    throw Error(
        where,
        fmt::format("has a point {:.1f} cm from the object's surface", 1e2 * std::abs(on.distance)),
        "Give points in the object's frame, in meters, on its surface");
  }
  stay.contact.point = on.closest;
  stay.contact.normal = on.gradient;
  if (entry.contains("normal")) {
    const Eigen::Vector3d normal = VectorOf(entry.at("normal"));
    if (!normal.allFinite() || normal.norm() < 1e-6) {
      throw Error(where, "has no direction as normal",
                  "Give an outward direction, or leave it out");
    }
    stay.contact.normal = normal.normalized();
  }
  return stay;
}

}  // namespace

std::string HandPartName(int part) {
  return part < kJointsPerHand ? fmt::format("{}{}", kFingerNames[part / 3], part % 3 + 1) : "palm";
}

int ParseHandPart(const std::string& name) {
  for (int part = 0; part < kNumHandParts; ++part) {
    if (name == HandPartName(part)) return part;
  }
  return -1;
}

nlohmann::json ContactsJson(const HumanDemonstration& demonstration) {
  std::vector<Stay> stays;
  std::map<int, std::size_t> open;  // by part: its entry that ends in the frame before
  for (int t = 0; t < std::ssize(demonstration.frames); ++t) {
    for (const PartContact& contact : demonstration.frames[t].contacts) {
      const auto before = open.find(contact.part);
      if (before != open.end() && stays[before->second].last == t - 1 &&
          (stays[before->second].contact.point - contact.point).norm() <= kMoved_m) {
        stays[before->second].last = t;
        continue;
      }
      open[contact.part] = stays.size();
      stays.push_back({t, t, contact});
    }
  }
  nlohmann::json contacts = nlohmann::json::array();
  for (const Stay& stay : stays) {
    contacts.push_back({{"part", HandPartName(stay.contact.part)},
                        {"frames", {stay.first, stay.last}},
                        {"point", Rounded(stay.contact.point)},
                        {"normal", Rounded(stay.contact.normal)}});
  }
  return {{"schema", kSchema}, {"hand", SideName(demonstration.side)}, {"contacts", contacts}};
}

void WriteContacts(const HumanDemonstration& demonstration, const std::filesystem::path& path) {
  WriteAtomically(path, JsonText(ContactsJson(demonstration), 1) + "\n");
}

void ReadContacts(const std::filesystem::path& path, const SignedDistance& object,
                  HumanDemonstration& demonstration) {
  const nlohmann::json file = ReadJson(path);
  // Compared as JSON: a schema of another type is no damage, but another file.
  if (!file.is_object() || !file.contains("contacts") || !file.contains("schema") ||
      file["schema"] != kSchema) {
    throw Error(path.string(), "is not a file of contacts",
                fmt::format("Give a contacts.json of 'holdfast transfer --robot' (\"schema\": "
                            "\"{}\"), edited",
                            kSchema));
  }
  const int frames = static_cast<int>(demonstration.frames.size());
  std::vector<Stay> stays;
  UseJson(path, [&] {
    if (const std::string hand = file.value("hand", std::string(SideName(demonstration.side)));
        hand != SideName(demonstration.side)) {
      throw Error(path.string(), fmt::format("has contacts of a {} hand", hand),
                  fmt::format("Give those of the {} hand", SideName(demonstration.side)));
    }
    for (const nlohmann::json& entry : file.at("contacts")) {
      const std::string where = fmt::format("{}: contact {}", path.string(), stays.size());
      stays.push_back(StayOf(entry, where, frames, object));
    }
  });
  bool any = false;
  for (int t = 0; t < frames; ++t) {
    HumanFrame& frame = demonstration.frames[t];
    if (!frame.holds) continue;
    frame.contacts.clear();
    for (const Stay& stay : stays) {
      if (t < stay.first || t > stay.last) continue;
      if (std::ranges::count(frame.contacts, stay.contact.part, &PartContact::part) > 0) {
        throw Error(
            path.string(),
            fmt::format("has two contacts of {} in frame {}", HandPartName(stay.contact.part), t),
            "Give one contact for each part and frame");
      }
      frame.contacts.push_back(stay.contact);
    }
    std::ranges::sort(frame.contacts, {}, &PartContact::part);
    frame.holds = !frame.contacts.empty();
    any = any || frame.holds;
  }
  if (!any) {
    throw Error(path.string(), "has no contact in a frame in which the hand holds the object",
                "Check the frames of its contacts");
  }
}

}  // namespace holdfast
