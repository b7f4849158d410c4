#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Sample sheets that are wrong are refused in one line that names file, line and remedy."""
import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../workflow/scripts"))
import sheet  # noqa: E402


class Sheet(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        for name in ("a.npz", "Größe 1.npz", "mug.obj"):
            open(os.path.join(self.folder.name, name), "w").close()

    def tearDown(self):
        self.folder.cleanup()

    def read(self, text, encoding="utf-8"):
        path = os.path.join(self.folder.name, "samples.csv")
        with open(path, "w", encoding=encoding) as file:
            file.write(text)
        return sheet.read(path, "/nowhere")

    def refused(self, text, *words, **more):
        with self.assertRaises(SystemExit) as raised:
            self.read(text, **more)
        for word in words:
            self.assertIn(word, str(raised.exception))
        self.assertNotIn("\n", str(raised.exception))

    def test_reads_blanks_umlauts_and_both_separators(self):
        for separator in ",\t":
            samples = self.read(f"motion{separator}object\n# a comment\n\na.npz{separator}mug\nGröße 1.npz{separator}mug.obj\n")
            self.assertEqual([s["name"] for s in samples], ["a", "Größe 1"])
            self.assertEqual(samples[0]["object"], "mug")
        line = sheet.solve_line(samples[1], "out/import/g")
        self.assertIn('"out/import/g/Größe 1.npz" "', line)
        self.assertTrue(line.endswith('mug.obj" "name=Größe 1"'))

    def test_refuses_what_is_wrong(self):
        head = "motion,object\n"
        self.refused(head + "b.npz,mug\n", "samples.csv:2", "'b.npz' is not there")
        self.refused(head + "a.npz,cup.obj\n", "'cup.obj' is not there")
        self.refused(head + "a.npz,mug\na.npz,apple\n", "samples.csv:3", "repeats the name 'a' of line 2")
        self.refused(head + "a.npz,mug,more\n", "3 cells for 2 columns")
        self.refused("motion,objekt\na.npz,mug\n", "'objekt'", "'object'")
        self.refused("object\nmug\n", "no column 'motion'")
        self.refused("motion,motion\na.npz,a.npz\n", "twice")
        self.refused(head, "no row")
        self.refused(head + "a.npz,\n", "no object")
        self.refused("motion,object,job\na.npz,mug,fitt\n", "neither fit nor refine")
        self.refused("motion,object,name\na.npz,mug,../b\n", "not a file name")
        self.refused(head + 'a.npz,"mug\nmug"\n', "samples.csv:3", "line break")
        self.refused(head + 'a.npz,"mug\nGröße 1.npz,"apple"\n', "samples.csv:3", "Close its quotes")
        self.refused(head + 'Größe 1.npz,"mug', "samples.csv:2", "Close its quotes")
        for column, value in (("hand", "middle"), ("hand", "clip"), ("start", "x"), ("start", "-1"), ("end", "1.5"), ("fps", "1e9"), ("object-scale", "0"), ("person", "-1"), ("up", "w")):
            self.refused(f"motion,object,{column}\na.npz,mug,{value}\n", "samples.csv:2", column, f"'{value}'")
        self.refused("motion,object\nGröße 1.npz,mug\n", "UTF-8", encoding="latin-1")
        with self.assertRaises(SystemExit):
            sheet.read("/nowhere/samples.csv")

    def test_rows_at_the_end_change_the_last_group_alone(self):
        samples = [{"name": str(k), "job": "fit" if k % 3 else "refine"} for k in range(20)]
        before, after = sheet.groups(samples[:15], 4), sheet.groups(samples, 4)
        whole = [group for group, own in before.items() if len(own) == 4]
        self.assertEqual([before[g] for g in whole], [after[g] for g in whole])
        with self.assertRaises(SystemExit):
            sheet.groups(samples, 0)

    def test_sweeps_are_all_combinations(self):
        variants = sheet.variants({"fit": "--paper"}, {"fit": {"a": [1, 2], "b": ["x"]}})
        self.assertEqual(variants["a=2,b=x"]["fit"], "--paper --a 2 --b x")
        self.assertEqual(list(sheet.variants({}, {})), ["default"])
        with self.assertRaises(SystemExit):
            sheet.variants({}, {"score": {"a": [1]}})


if __name__ == "__main__":
    unittest.main()
