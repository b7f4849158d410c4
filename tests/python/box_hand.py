# SPDX-License-Identifier: MIT
"""A right hand of boxes with four fingers and a thumb, as URDF."""

FINGER = """
<link name="{name}_{p}"><visual><origin xyz="0 0 {half}"/><geometry><box size="0.014 0.014 {length}"/>
</geometry></visual></link>
<joint name="bend_{name}_{p}" type="revolute"><parent link="{parent}"/><child link="{name}_{p}"/>
<origin xyz="{at}" rpy="{roll} 0 0"/><axis xyz="0 1 0"/>
<limit lower="-0.1" upper="1.6" effort="1" velocity="1"/></joint>
"""


def write_box_hand(path):
    text = """<robot name="boxes"><link name="palm"><visual><origin xyz="0 0 0.045"/><geometry>
<box size="0.02 0.09 0.09"/></geometry></visual></link>"""
    bases = [(f"digit_{k}", f"0 {0.03 - 0.02 * k} 0.092", 0.0) for k in range(4)]
    for name, at, roll in bases + [("digit_x", "0.005 0.05 0.03", -1.2)]:
        parent = "palm"
        for p, length in enumerate((0.045, 0.028, 0.024)):
            text += FINGER.format(name=name, p=p, half=length / 2, length=length, parent=parent,
                                  at=at, roll=roll)
            parent, at, roll = f"{name}_{p}", f"0 0 {length}", 0.0
    path.write_text(text + "</robot>")
    return path
