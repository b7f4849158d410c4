# SPDX-License-Identifier: MIT
"""Hands made of boxes and capsules, with proportions and joint ranges of published robot hands, as URDF.

Lengths are in meters, angles in degrees. A right hand: fingers toward +z, palm toward +x, thumb at +y. They
are for measuring how transfers generalize (transfers.py --robots), not models of these products.
"""
import math


class Joint:
    """A joint and the link behind it, of some length along z. Axis: y bends, x spreads, z turns."""
    def __init__(self, axis, low, high, length, follows=None):
        self.axis, self.low, self.high, self.length, self.follows = axis, low, high, length, follows


def bend(high, length, low=0.0, follows=None):
    return Joint("y", low, high, length, follows)


def spread(low, high, length=0.0):
    return Joint("x", low, high, length)


def fingers(count, y, step, z, joints, names="index middle ring pinky"):
    """Parallel fingers side by side: name, position, roll-pitch-yaw, joints."""
    return [(name, (0.0, y - step * k, z), (0.0, 0.0, 0.0), joints) for k, name in zip(range(count), names.split())]


# palm: size, center; then the fingers; then the radius of their links. `follows`: a finger's joint of this number
# times the factor is the value of this one.
HANDS = {
    "shadow_like": (((0.022, 0.085, 0.095), (-0.004, -0.002, 0.047)), [
        *fingers(4, 0.033, 0.022, 0.095, [spread(-20, 20), bend(90, 0.045, -15), bend(90, 0.025), bend(90, 0.024)]),
        ("thumb", (0.01, 0.034, 0.029), (-45.0, 0.0, 0.0),
         [Joint("z", -60, 60, 0.0), bend(70, 0.038), spread(-12, 12), bend(40, 0.032, -40), bend(90, 0.0275)])], 0.009),
    "leap_like": (((0.035, 0.13, 0.1), (-0.015, -0.005, 0.045)), [
        *fingers(3, 0.045, 0.0454, 0.095, [bend(120, 0.015, -20), Joint("z", -60, 60, 0.04), bend(110, 0.036, -30), bend(115, 0.05, -20)]),
        ("thumb", (0.01, 0.045, 0.02), (-60.0, 0.0, 0.0),
         [bend(120, 0.015, -20), Joint("z", -20, 110, 0.035), bend(110, 0.045, -60), bend(105, 0.05, -70)])], 0.012),
    "inspire_like": (((0.025, 0.078, 0.1), (-0.003, -0.002, 0.05)), [
        *fingers(4, 0.03, 0.02, 0.1, [bend(84, 0.034), bend(97, 0.045, follows=(0, 1.13))]),
        ("thumb", (0.014, 0.03, 0.03), (-55.0, 0.0, 0.0),
         [Joint("z", -10, 70, 0.012), bend(34, 0.05), bend(50, 0.025, follows=(1, 1.5)), bend(40, 0.025, follows=(1, 1.0))])], 0.0085),
    "barrett_like": (((0.075, 0.1, 0.08), (0.0, 0.0, 0.02)), [
        ("spread_one", (-0.02, 0.025, 0.06), (0.0, 0.0, 0.0), [Joint("z", -5, 90, 0.0), bend(90, 0.07, -50), bend(48, 0.058, -17, follows=(1, 0.34))]),
        ("spread_two", (-0.02, -0.025, 0.06), (0.0, 0.0, 0.0), [Joint("z", -90, 5, 0.0), bend(90, 0.07, -50), bend(48, 0.058, -17, follows=(1, 0.34))]),
        ("fixed", (0.045, 0.0, 0.06), (0.0, 0.0, 180.0), [bend(90, 0.07, -50), bend(48, 0.058, -17, follows=(0, 0.34))])], 0.011),
}


def _pose(xyz, rpy=(0.0, 0.0, 0.0)):
    return f'<origin xyz="{xyz[0]:g} {xyz[1]:g} {xyz[2]:g}" rpy="{" ".join(f"{math.radians(a):.9g}" for a in rpy)}"/>'


def _link(name, shape=""):
    visual = f"<visual>{shape}</visual><collision>{shape}</collision>" if shape else ""
    return (f'<link name="{name}"><inertial><mass value="0.02"/><inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" '
            f'iyz="0" izz="1e-5"/></inertial>{visual}</link>\n')


def urdf(name):
    """The hand of this name as URDF text."""
    (size, center), all_fingers, radius = HANDS[name]
    box = f'<geometry><box size="{size[0]:g} {size[1]:g} {size[2]:g}"/></geometry>'
    text = f'<?xml version="1.0"?>\n<robot name="{name}">\n' + _link("palm", _pose(center) + box)
    for finger, xyz, rpy, joints in all_fingers:
        parent, place = "palm", _pose(xyz, rpy)
        for k, joint in enumerate(joints):
            link = f"{finger}_{k}"
            shape = ""
            if joint.length > 2.0 * radius:
                shape = _pose((0.0, 0.0, 0.5 * joint.length)) + (
                    f'<geometry><capsule radius="{radius:g}" length="{joint.length:g}"/></geometry>')
            text += _link(link, shape)
            follows = "" if not joint.follows else (
                f'<mimic joint="{finger}_{joint.follows[0]}_joint" multiplier="{joint.follows[1]:g}"/>')
            axis = " ".join("1" if a == joint.axis else "0" for a in "xyz")
            text += (f'<joint name="{link}_joint" type="revolute"><parent link="{parent}"/><child link="{link}"/>{place}'
                     f'<axis xyz="{axis}"/><limit lower="{math.radians(joint.low):.9g}" upper="{math.radians(joint.high):.9g}" '
                     f'effort="1" velocity="3"/>{follows}</joint>\n')
            parent, place = link, _pose((0.0, 0.0, joint.length))
    return text + "</robot>\n"


# The Franka hand: two fingers that slide.
GRIPPER = """<?xml version="1.0"?>
<robot name="panda_like">
<link name="palm"><inertial><mass value="0.7"/><inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial>
<visual><origin xyz="0 0 0.03"/><geometry><box size="0.04 0.2 0.06"/></geometry></visual></link>
{}</robot>
"""


def gripper():
    text = ""
    for name, side in ("one", 1), ("two", -1):
        shape = f'{_pose((0.0, 0.011 * side, 0.027))}<geometry><box size="0.02 0.022 0.054"/></geometry>'
        text += _link(name, shape)
        text += (f'<joint name="{name}_joint" type="prismatic"><parent link="palm"/><child link="{name}"/>{_pose((0.0, 0.0, 0.058))}'
                 f'<axis xyz="0 {side} 0"/><limit lower="0" upper="0.04" effort="70" velocity="0.2"/></joint>\n')
    return GRIPPER.format(text)


def write_hands(folder):
    """Writes all hands as FOLDER/NAME.urdf and returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = {name: urdf(name) for name in HANDS} | {"panda_like": gripper()}
    for name, text in texts.items():
        (folder / f"{name}.urdf").write_text(text)
    return [folder / f"{name}.urdf" for name in texts]
