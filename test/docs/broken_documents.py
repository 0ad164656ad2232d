"""Shows that each rule of check_documents.py can fail: a small repository without problems is broken in one place at a time."""
import tempfile
import unittest
from pathlib import Path

import check_documents
from repository import Repository

GOOD = {
    'CMakeLists.txt': 'project(slender_sim VERSION 0.1.0)\n',
    'cmake/targets.cmake': 'add_executable(simulate src/tools/simulate.cpp)\nadd_executable(study src/tools/study.cpp)\n'
                           'foreach(node rod_node)\nendforeach()\n',
    'src/tools/simulate.cpp': '#include "arguments.h"\nconst char* usage = "  --csv DIR  tables\\n  --set PATH=VALUE";\n'
                              'int main(int argc, char** argv) {}\n',
    'src/tools/arguments.h': 'const char* more = "--quiet";\n',
    'src/tools/study.cpp': 'const char* usage = "[--out DIR]";\nint main(int, char**) {}\n',
    'src/tools/unbuilt.cpp': 'int main(int, char**) {}\n',
    'src/nodes/rod_node.cpp': 'int main(int, char**) {}\n',
    'src/node/node_options.cpp': 'nh.param("max_lag", x); nh.advertiseService("pause");\n',
    'src/study/rod/knot.cpp': 'const StudyRegistration kKnotRegistration{\n    "knot", "knots", runKnot};\n',
    'src/scene/reader/sweep_plan.cpp': 'map.require("name"); map.require("scene"); map.require("axes");\n',
    'include/slender_sim/contact/shape.h': '',
    'launch/rod.launch': '<launch><arg name="scene" doc="scene"/><arg name="set" default="[]"/>'
                         '<include file="x"><arg name="inner" value="1"/></include></launch>\n',
    'msg/Fields.msg': 'float64[] value   # [m]\n',
    'scripts/demo': '#!/bin/bash\n# demo [--headless]\n',
    'config/scenes/chain.yaml': 'name: chain\n',
    'docs/picture.png': '',
    'test/library/main.cpp': 'int main()\n{\n}\n',
    'docs/library.md': '# The library\n\n```cpp\nint main()\n{\n}\n```\n\n## Errors\n',
    'docs/scene_reference.md': '''# Keys

| Key | Value |
|---|---|
| `name` | a name |
| `gravity` | a list [x, y, z] of numbers in [-1, 1] |
| `time.step` | a number in (0, 10] s |
| `rods.N.material.density` | a number |
| `rods.N.cross_section.ellipse` | a list, each entry a number |
| `tracked.N.functions` | a list of maps; or a map | |
| `tracked.N.functions.basis` | one of: hats |
| `generate.N.chain.material` | a map, keys as of [`rods.N.material`](#keys) |
| `rods.N.grasps.NAME.edges.N` | a place |
| `rods.N.grasps.NAME.motion` | one of: fixed |
| `rods.N.grasps.NAME.motion.topic` | true or false |
| `rods.N.grasps.NAME.motion.table.N` | a number or a list of numbers |

## More
''',
    'docs/studies.md': '# Studies\n\n    study list\n\n## Rods\n\n| Study | |\n|---|---|\n| `knot` | knots |\n',
    'docs/README.md': '# Index\n\n- [A page](page.md)\n- [studies](studies.md)\n- [keys](scene_reference.md)\n- [library](library.md)\n\n## By subject\n',
    'README.md': '# slender_sim\n\nSee [the page](docs/page.md#what-it-does-twice).\n\n## Two commands\n\n    scripts/demo --headless\n',
    'CHANGELOG.rst': 'Changelog\n=========\n\n0.1.0\n-----\n* One entry\n  of two lines.\n* Another.\n',
    'docs/page.md': '''# A page

Words, and [a link](README.md) to the index.

    rosrun slender_sim simulate config/scenes/chain.yaml --csv out --quiet \\
      --set rods.0.grasps.left.motion.topic=true      # a comment with --none
    roslaunch slender_sim rod.launch scene:=chain.yaml set:="[time.step=0.1]"
    scripts/demo --headless && study run knot --out out/knot
    rosrun slender_sim rod_node _max_lag:=2

## What it does, `twice`

Key `time.step`, `motion: {topic: true}`, `{topic: true}`, `gravity.2`, `~pause`,
`value: 3`, `scene:=FILE`, `grasps: {NAME: {edges: [0]}}`, `material: {density or density}`,
`include/slender_sim/ROOM`, `contact/shape.h`, `slender_sim/Fields`.

![picture](picture.png)

```yaml
name: chain
rods:
  - material: {density: 1000}
    cross_section: {ellipse: [1, 2]}
    grasps:
      left: {edges: [0]}
      right: {edges: [-1], motion: {table: [[0, 1, 2], [1, 1, 2]]}}
```

```yaml
    grasps:
      left: {edges: [0], motion: fixed}
```

```yaml
generate:
  - chain:
      material: {density: 1}
tracked:
  - functions: [{basis: hats}, {basis: hats}]
```

```yaml
name: plan
scene: chain.yaml
axes: {rods.0.material.density: [1, 2], gravity.2: [0, 1]}
```

1. An item, with code of its own:

       study run knot

   and words after it.
''',
}

LONG = 'word ' * 21
BREAKS = [   # (what breaks, file, text, what stands there instead, problem that must be found)
    ('wide line', 'docs/page.md', 'Words, and', LONG + 'and', 'columns'),
    ('wide heading', 'docs/page.md', '# A page', '# ' + LONG, 'columns'),
    ('wide item', 'docs/page.md', '1. An item', '1. ' + LONG, 'columns'),
    ('long paragraph', 'docs/page.md', 'Words, and', 'one\ntwo\nthree\nfour\nfive\nsix', 'paragraph of 6 lines'),
    ('long item', 'docs/page.md', '   and words after it.', '   one\n   two\n   three\n   four\n   five\n   six', 'paragraph of 6 lines'),
    ('many lines', 'README.md', 'See', 'line\n\n' * 60 + 'See', 'lines; at most 120'),
    ('many words', 'README.md', 'See', 'a b c d e f\n\n' * 20 + 'word ' * 10 + '\n\n' + ('w ' * 40 + '\n\n') * 20 + 'See', 'words; at most 900'),
    ('no sub-heading', 'README.md', '## Two commands', 'Two commands', 'no sub-heading'),
    ('no example', 'docs/page.md', 'Words, and [a link](README.md) to the index.\n', '## Early\n', 'does not open with an example'),
    ('link to no file', 'docs/page.md', '(README.md)', '(missing.md)', 'link to missing.md'),
    ('link to no heading', 'README.md', '#what-it-does-twice', '#what-it-does', 'has no such heading'),
    ('picture', 'docs/page.md', '(picture.png)', '(missing.png)', 'link to missing.png'),
    ('picture in HTML', 'docs/page.md', '![picture](picture.png)', '<img width="9" src="missing.png">', 'link to missing.png'),
    ('page outside the index', 'docs/README.md', '[A page](page.md)', 'A page', 'does not link to this page'),
    ('program that is not the file', 'docs/library.md', 'main()\n{', 'main() {', 'does not show test/library/main.cpp'),
    ('path in code', 'docs/page.md', 'config/scenes/chain.yaml --csv', 'config/scenes/missing.yaml --csv', 'path config/scenes/missing.yaml'),
    ('path in a sentence', 'docs/page.md', '`include/slender_sim/ROOM`', '`test/unit/missing.cpp`', 'path test/unit/missing.cpp'),
    ('path with braces', 'docs/page.md', '`include/slender_sim/ROOM`', '`scripts/{demo,missing}`', 'path scripts/{demo,missing}'),
    ('installed path', 'docs/page.md', 'scene:=chain.yaml', 'scene:=$(rospack find slender_sim)/config/missing.yaml', 'path config/missing.yaml'),
    ('file of a room', 'docs/page.md', '`contact/shape.h`', '`contact/missing.h`', 'src/ has contact/missing.h'),
    ('message', 'docs/page.md', '`slender_sim/Fields`', '`slender_sim/Missing`', 'no message or service slender_sim/Missing'),
    ('program', 'docs/page.md', 'slender_sim simulate', 'slender_sim simulato', 'no program simulato'),
    ('program that is not built', 'docs/page.md', 'slender_sim simulate', 'slender_sim unbuilt', 'no program unbuilt'),
    ('option', 'docs/page.md', '--quiet', '--quite', 'simulate has no option --quite'),
    ('option on the next line', 'docs/page.md', '--set rods', '--sets rods', 'simulate has no option --sets'),
    ('option in a sentence', 'docs/page.md', '`~pause`', '`simulate SCENE.yaml [--none]`', 'simulate has no option --none'),
    ('option of a script', 'docs/page.md', 'scripts/demo --headless', 'scripts/demo --none', 'scripts/demo has no option --none'),
    ('override', 'docs/page.md', 'grasps.left.motion', 'grips.left.motion', 'no key rods.0.grips'),
    ('override of a launch file', 'docs/page.md', '[time.step=0.1]', '[time.stop=0.1]', 'no key time.stop'),
    ('launch file', 'docs/page.md', 'rod.launch', 'missing.launch', 'no launch file missing.launch'),
    ('argument of a launch file', 'docs/page.md', 'rod.launch scene', 'rod.launch inner', 'rod.launch has no argument inner'),
    ('argument in a sentence', 'docs/page.md', '`scene:=FILE`', '`inner:=FILE`', 'no launch file has an argument inner'),
    ('study', 'docs/page.md', 'study run knot --out', 'study run knots --out', 'no study knots'),
    ('study in a list', 'docs/page.md', '       study run knot\n', '       study run knots\n', 'no study knots'),
    ('study that is left out', 'docs/studies.md', '| `knot` |', '| knot |', 'study knot is in no table'),
    ('study in a table', 'docs/studies.md', '| `knot` |', '| `knot`, `knots` |', 'no study knots'),
    ('parameter of a node', 'docs/page.md', '_max_lag', '_max_leg', 'no node has a parameter ~max_leg'),
    ('service of a node', 'docs/page.md', '`~pause`', '`~pose`', 'service ~pose'),
    ('key of a scene', 'docs/page.md', '{density: 1000}', '{desnity: 1000}', 'no key desnity'),
    ('key at the wrong place', 'docs/page.md', 'cross_section: {ellipse', 'ellipse: {cross_section', 'no key ellipse'),
    ('key of a grasp', 'docs/page.md', 'right: {edges', 'right: {edge', 'no key edge'),
    ('key that two places share', 'docs/page.md', '      material: {density: 1}', '      material: {desnity: 1}', 'no key desnity'),
    ('key in a list of maps', 'docs/page.md', '{basis: hats}]', '{bases: hats}]', 'no key bases'),
    ('list where none belongs', 'docs/page.md', '  - material: {density: 1000}', '  - material: [{density: 1000}]', 'for a list with maps'),
    ('key of a fragment', 'docs/page.md', 'motion: fixed', 'motions: fixed', 'no key motions'),
    ('key of a plan', 'docs/page.md', 'scene: chain.yaml', 'scenes: chain.yaml', 'sweeps have no key scenes'),
    ('axis of a plan', 'docs/page.md', 'axes: {rods.0.material', 'axes: {rods.0.materials', 'no key rods.0.materials'),
    ('YAML', 'docs/page.md', 'name: plan', 'name: [plan', 'no YAML'),
    ('key in a sentence', 'docs/page.md', '`time.step`', '`time.stop`', 'no such key'),
    ('fragment in a sentence', 'docs/page.md', '`motion: {topic: true}`', '`motion: {tpic: true}`', 'no such key (tpic)'),
    ('braces in a sentence', 'docs/page.md', '`{topic: true}`', '`{tpic: true}`', 'no such key (tpic)'),
    ('one of two keys', 'docs/page.md', '{density or density}', '{density or dens}', 'no such key (dens)'),
    ('long entry', 'CHANGELOG.rst', '  of two lines.', '  of\n  three lines.', 'entry of more than 2 lines'),
    ('wide entry', 'CHANGELOG.rst', 'Another.', LONG, 'CHANGELOG.rst:8: line of'),
]


PAGES = ['README.md', 'docs/README.md', 'docs/library.md', 'docs/page.md', 'docs/scene_reference.md', 'docs/studies.md']


class Documents(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        for name, text in GOOD.items():
            cls.write(name, text)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def write(cls, name, text):
        path = Path(cls.folder.name) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding='utf-8')

    def problems(self, rules=check_documents.RULES):
        repository = Repository(self.folder.name)
        return check_documents.check(repository, PAGES, rules) + check_documents.check_changelog(repository)

    def test_good_documents_have_no_problem(self):
        self.assertEqual(self.problems(), [])

    def test_each_break_is_found(self):
        unbroken = list(check_documents.RULES)
        for what, name, text, instead, expected in BREAKS:
            with self.subTest(what):
                self.assertIn(text, GOOD[name], 'nothing to break')
                self.write(name, GOOD[name].replace(text, instead, 1))
                try:
                    found = self.problems()
                    self.assertTrue(any(expected in problem for problem in found), found)
                    if name != 'CHANGELOG.rst':
                        unbroken = [r for r in unbroken if not any(expected in p for p in self.problems([r]))]
                finally:
                    self.write(name, GOOD[name])
        self.assertEqual(unbroken, [], 'no break for these rules')


def passes():
    suite = unittest.defaultTestLoader.loadTestsFromTestCase(Documents)
    return unittest.TextTestRunner(verbosity=0).run(suite).wasSuccessful()
