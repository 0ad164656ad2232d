"""What documents may name: programs, options, launch files, studies, parameters and keys of scenes, as the sources have them."""
import re
import sys
from functools import cached_property, lru_cache
from pathlib import Path

try:
    import yaml
except ImportError:
    sys.exit('check_documents.py needs PyYAML (Debian: python3-yaml)')

CPP_STRING = re.compile(r'"((?:[^"\\\n]|\\.)*)"')


def read(path):
    return path.read_text(encoding='utf-8', errors='replace')


class Keys:
    """Keys of scene files, a tree of docs/scene_reference.md. N stands for a place in a list, NAME for a name of the user's."""

    def __init__(self, text):
        self.root = {}
        self.maps = set()   # identities of the nodes that take a list of maps, whose keys are below the node itself
        shared = []
        for path, rest in re.findall(r'^\| `([\w.]+)` \|(.*)$', text, re.M):
            node = self._at(path)
            if 'a list of maps' in rest.split('|')[0]:
                self.maps.add(id(node))
            shared += [(node, owner) for owner in re.findall(r'keys as of \[`([\w.]+)`\]', rest)]
        for node, owner in shared + shared:   # twice, for owners that share the keys of others
            for key, below in self._at(owner).items():
                node.setdefault(key, below)
        self.anchors = list(self._anchors(self.root, set()))

    def _at(self, path):
        node = self.root
        for part in path.split('.'):
            node = node.setdefault(part, {})
        return node

    def _anchors(self, node, seen):
        if id(node) not in seen:
            seen.add(id(node))
            yield node
            for child in node.values():
                yield from self._anchors(child, seen)

    def misses(self, node, value):
        """Keys of a YAML value that the reference does not have at this node."""
        if isinstance(value, dict):
            for key, below in ((k, v) for keys, v in value.items() for k in str(keys).split(' or ')):
                head, *rest = key.split('.')
                for part in reversed(rest):
                    below = {part: below}
                child = self.child(node, head, below)
                if child is None:
                    yield str(key)
                else:
                    yield from self.misses(child, below)
        elif isinstance(value, list):
            for entry in value:
                if 'N' in node:
                    yield from self.misses(node['N'], entry)
                elif id(node) in self.maps:
                    yield from self.misses(node, entry)
                elif contains_mapping(entry):
                    yield 'for a list with maps'

    @staticmethod
    def child(node, key, below):
        if key in node:
            return node[key]
        if re.fullmatch(r'-?\d+|N', key) and ('N' in node or not node):   # of a list of numbers the reference has no N
            return node.get('N', node)
        if 'NAME' in node and (key == 'NAME' or isinstance(below, (dict, list))):
            return node['NAME']
        return None

    def unknown(self, value, anywhere=True):
        """Keys without a place: those missing under the part of the reference that has most of them."""
        if not anywhere:
            return list(self.misses(self.root, value))
        best = None
        for node in self.anchors:
            missing = list(self.misses(node, value))
            if not missing:
                return []
            top = sum(self.child(node, str(k).split('.')[0], v) is not None for k, v in value.items()) \
                if isinstance(value, dict) else 0
            if best is None or (-top, len(missing)) < best[0]:
                best = (-top, len(missing)), missing
        return best[1] if best else []


def contains_mapping(value):
    return isinstance(value, dict) or isinstance(value, list) and any(contains_mapping(v) for v in value)


class Repository:
    def __init__(self, root):
        self.root = Path(root)

    @cached_property
    def keys(self):
        return Keys(read(self.root / 'docs/scene_reference.md'))

    @cached_property
    def programs(self):
        """Programs with a main function that CMake builds, each with its source."""
        cmake = ''.join(read(f) for f in [self.root / 'CMakeLists.txt', *sorted(self.root.glob('cmake/*.cmake'))])
        found = {}
        for source in [*self.root.glob('src/tools/*.cpp'), *self.root.glob('src/nodes/*.cpp')]:
            if re.search(r'\bmain\(', read(source)) and re.search(r'\b%s\b' % source.stem, cmake):
                found[source.stem] = source
        found.update((script.name, script) for script in self.scripts if re.search(r'PROGRAMS[^)]*\b%s\b' % script.name, cmake))
        return found

    @cached_property
    def scripts(self):
        """Scripts that are nodes."""
        return [f for f in self.root.glob('scripts/*') if f.is_file() and 'import rospy' in read(f)]

    @lru_cache(maxsize=None)
    def options(self, program):
        """Options that a program's strings name, in its source and the files beside it that it includes."""
        source = self.programs[program]
        files, todo = set(), [source]
        while todo:
            file = todo.pop()
            if file in files or not file.exists():
                continue
            files.add(file)
            for header in re.findall(r'#include "([\w/]+)\.h"', read(file)):
                todo += [source.parent / (header + '.h'), source.parent / (header + '.cpp')]
        strings = ' '.join(s for f in files for s in CPP_STRING.findall(read(f)))
        return set(re.findall(r'--[a-z][a-z-]*', strings)) | {'--help'}

    @cached_property
    def studies(self):
        found = {'all'}
        for source in self.root.glob('src/study/*/*.cpp'):
            found.update(re.findall(r'StudyRegistration\s+\w+\s*\{\s*"(\w+)"', read(source)))
        return found

    @cached_property
    def launch_arguments(self):
        """Arguments per launch file. An include with pass_all_args takes those of the included file as well."""
        texts = {f.name: read(f) for f in self.root.glob('launch/*.launch')}
        found = {name: set(re.findall(r'<arg name="(\w+)"(?![^>]*\bvalue=)', text)) for name, text in texts.items()}
        return {name: found[name].union(*(found.get(other, set()) for other in re.findall(
            r'<include file="[^"]*/(\w+\.launch)" pass_all_args="true"', text))) for name, text in texts.items()}

    @cached_property
    def node_names(self):
        """Names of parameters, services and topics: the strings of the node library, and of nodes that are scripts."""
        return {s.lstrip('~') for f in [*self.scripts, *self.root.glob('src/node/*.cpp'),
                                        *self.root.glob('include/slender_sim/node/*.h'),
                                        *self.root.glob('src/nodes/*.cpp')] for s in CPP_STRING.findall(read(f))}

    @cached_property
    def interfaces(self):
        return {f.stem for f in [*self.root.glob('msg/*.msg'), *self.root.glob('srv/*.srv')]}

    @cached_property
    def fields(self):
        """Names of the fields of messages and services."""
        return {name for f in [*self.root.glob('msg/*.msg'), *self.root.glob('srv/*.srv')]
                for name in re.findall(r'^[\w/]+(?:\[\d*\])?\s+([a-z]\w*)', read(f), re.M)}

    @cached_property
    def plan_keys(self):
        """Keys of sweep plans: what their reader asks for."""
        source = self.root / 'src/scene/reader/sweep_plan.cpp'
        return set(re.findall(r'"([a-z_]+)"', read(source))) if source.exists() else set()

    def exists(self, path):
        if re.search(r'[*?{]', path):
            return all(any(self.root.glob(p)) for p in braces(path))
        return (self.root / path).exists()


def braces(path):
    match = re.search(r'\{([^{}]*)\}', path)
    if not match:
        return [path]
    return [p for word in match.group(1).split(',') for p in braces(path[:match.start()] + word + path[match.end():])]


def parse_yaml(text):
    """The value of a piece of YAML, or None if it is none."""
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return None
