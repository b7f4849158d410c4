// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>

namespace holdfast::testing {

/// A hand made of boxes, as URDF: fingers up (+z), palm facing +x, the thumb at +y on a right hand.
struct BoxHand {
  int fingers = 4;  ///< besides the thumb, from its side outwards
  bool left = false;
  bool coupled = false;    ///< each end phalanx follows the middle one
  double scale = 1.0;      ///< 1000: somebody wrote millimeters
  std::string extra = "";  ///< elements at the end

  std::string Urdf() const {
    std::string text = "<?xml version=\"1.0\"?>\n<robot name=\"box_hand\">\n" +
                       Link("palm", 0.02, 0.09, 0.09, 0.045);
    const double side = left ? -1.0 : 1.0;
    for (int f = 0; f < fingers; ++f) {
      AddFinger(fmt::format("digit_{}", f), {0.0, side * (0.03 - 0.02 * f), 0.092}, 0.0, text);
    }
    AddFinger("digit_x", {0.005, side * 0.05, 0.03}, -side * 1.2, text);
    return text + extra + "</robot>\n";
  }
  void Write(const std::filesystem::path& path) const { std::ofstream(path) << Urdf(); }

 private:
  struct Place {
    double x, y, z;
  };
  std::string Link(const std::string& name, double x, double y, double z, double up) const {
    return fmt::format(
        "<link name=\"{}\"><inertial><mass value=\"0.02\"/><inertia ixx=\"1e-5\" ixy=\"0\" "
        "ixz=\"0\" iyy=\"1e-5\" iyz=\"0\" izz=\"1e-5\"/></inertial><visual><origin xyz=\"0 0 "
        "{}\"/><geometry><box size=\"{} {} {}\"/>"
        "</geometry></visual></link>\n",
        name, scale * up, scale * x, scale * y, scale * z);
  }
  void AddFinger(const std::string& name, const Place& place, double roll,
                 std::string& text) const {
    constexpr double kLengths[] = {0.045, 0.028, 0.024};
    std::string parent = "palm";
    for (int p = 0; p < 3; ++p) {
      const std::string link = fmt::format("{}_{}", name, p);
      text += Link(link, 0.014, 0.014, kLengths[p], 0.5 * kLengths[p]);
      const Place at = p == 0 ? place : Place{0.0, 0.0, kLengths[p - 1]};
      text += fmt::format(
          "<joint name=\"bend_{}\" type=\"revolute\"><parent link=\"{}\"/><child link=\"{}\"/>"
          "<origin xyz=\"{} {} {}\" rpy=\"{} 0 0\"/><axis xyz=\"0 1 0\"/>"
          "<limit lower=\"-0.1\" upper=\"1.6\" effort=\"1\" velocity=\"1\"/>{}</joint>\n",
          link, parent, link, scale * at.x, scale * at.y, scale * at.z, p == 0 ? roll : 0.0,
          p == 2 && coupled
              ? fmt::format("<mimic joint=\"bend_{}_1\" multiplier=\"0.7\" offset=\"0.05\"/>", name)
              : "");
      parent = link;
    }
  }
};

}  // namespace holdfast::testing
