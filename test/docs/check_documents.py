#!/usr/bin/python3
"""Checks README.md, docs/*.md and CHANGELOG.rst: their form, and that what they name is there.

check_documents.py [--self-test] [FILE...]     FILE: only these pages
--self-test first shows, by broken documents, that each rule can fail (broken_documents.py).
Needs PyYAML (Debian: python3-yaml), and neither ROS nor a build.
"""
import re
import shlex
import sys
from pathlib import Path

sys.dont_write_bytecode = True   # no __pycache__ in the sources

import markdown
from repository import Repository, contains_mapping, parse_yaml

WIDTH = 100                     # columns of text outside tables and code
PARAGRAPH = 5                   # lines of a paragraph or of an item of a list
README_LINES, README_WORDS = 120, 900
ENTRY = 2                       # lines of an entry of the change log

GENERATED = {'docs/scene_reference.md', 'docs/results.md'}   # by scene_reference and by `study report`
# Pages that need no example before their first sub-heading: generated ones, the index, and README, which opens with a film.
WITHOUT_EXAMPLE = GENERATED | {'docs/README.md', 'README.md'}

# Inline code that looks like keys of a scene and is something else.
NOT_SCENES = {
    '{left_wrist: left}': 'parameter ~bodies of motion_player',
    'numpy.bool': 'a name of Python',
}
WORKSPACE = 'src/slender_sim'   # this package in a catkin workspace
SHELL = {'', 'sh', 'bash', 'shell', 'console'}
FOLDERS = 'scripts|config|launch|test|src|include|bench|docs|cmake|msg|srv'
PATH = re.compile(r'(?<![\w./$~-])(?:\$\((?:rospack )?find slender_sim\)/)?((?:%s)/[\w./*{},-]*)' % FOLDERS)
ROOMS = 'linalg|geometry|energy|dynamics|contact|rod|thread|cloth|tracking|world|fairing|scene|node|study'
ROOM_FILE = re.compile(r'(?<![\w./-])((?:%s)/[\w/]+\.(?:h|cpp))' % ROOMS)
FILE_NAME = re.compile(r'\.(?:ya?ml|md|csv|py|cpp|h|launch|test|bag|mp4|gif|glb|obj|ply|png|svg|html|json|so|xml|txt|rst|cmake|'
                       r'deb|rviz|active|part|supp|msg|srv|org|gltf)$')
LINK = re.compile(r'!?\[[^\]]*\]\(\s*<?([^)\s>]+)>?[^)]*\)|<(?:img|a|source|video)\b[^>]*?\b(?:src|href)="([^"]+)"|^\[[^\]]+\]:\s*(\S+)',
                  re.M | re.S)


class Page:
    def __init__(self, repository, name):
        self.repository, self.name = repository, name
        self.text = (repository.root / name).read_text(encoding='utf-8')
        self.blocks = markdown.blocks(self.text)
        self.problems = []

    def problem(self, line, text):
        found = '%s:%d: %s' % (self.name, line, text)
        if found not in self.problems:
            self.problems.append(found)


# ------------------------------------------------------------------ form

def check_width(page):
    for block in page.blocks:
        if block.kind in ('paragraph', 'heading', 'html'):
            for k, line in enumerate(block.lines):
                if len(line) > WIDTH:
                    page.problem(block.line + k, 'line of %d columns; at most %d outside tables and code' % (len(line), WIDTH))


def check_paragraphs(page):
    for block in page.blocks:
        if block.kind == 'paragraph' and len(block.lines) > PARAGRAPH:
            page.problem(block.line, 'paragraph of %d lines; at most %d' % (len(block.lines), PARAGRAPH))


def check_size(page):
    if page.name != 'README.md':
        return
    lines, words = page.text.count('\n'), len(page.text.split())
    if lines > README_LINES:
        page.problem(1, '%d lines; at most %d' % (lines, README_LINES))
    if words > README_WORDS:
        page.problem(1, '%d words; at most %d' % (words, README_WORDS))


def check_opening(page):
    sub = [k for k, b in enumerate(page.blocks) if b.kind == 'heading' and b.level == 2]
    if not sub:
        page.problem(1, 'has no sub-heading (##)')
    before = page.blocks[:sub[0]] if sub else page.blocks
    if page.name not in WITHOUT_EXAMPLE and not any(b.kind == 'code' for b in before):
        page.problem(1, 'does not open with an example: there is no code before the first sub-heading')


# ------------------------------------------------------------------ links

def check_links(page):
    root = page.repository.root
    folder = (root / page.name).parent
    for block in page.blocks:
        if block.kind == 'code':
            continue
        text = re.sub(r'`[^`\n]*`', lambda m: ' ' * len(m.group()), block.text)
        for match in LINK.finditer(text):
            target = next(g for g in match.groups() if g)
            line = block.line + text.count('\n', 0, match.start())
            if re.match(r'[a-z]+:', target):
                continue
            path, _, anchor = target.partition('#')
            file = folder / path if path else root / page.name
            if not file.exists():
                page.problem(line, 'link to %s, which is not there' % target)
            elif anchor and file.suffix == '.md' and anchor not in markdown.anchors(
                    markdown.blocks(file.read_text(encoding='utf-8'))):
                page.problem(line, 'link to %s: %s has no such heading' % (target, file.name))


def check_index(page):
    """Each page is linked from the index."""
    index = page.repository.root / 'docs/README.md'
    if page.name.startswith('docs/') and page.name != 'docs/README.md':
        if not index.exists() or not re.search(r'\]\(%s[)#]' % re.escape(Path(page.name).name), index.read_text(encoding='utf-8')):
            page.problem(1, 'docs/README.md does not link to this page')


def check_programs(page):
    """docs/library.md shows the files of test/library word by word."""
    if page.name != 'docs/library.md':
        return
    shown = [b.text.strip('\n') for b in page.blocks if b.kind == 'code']
    for path in sorted((page.repository.root / 'test/library').glob('*')):
        if path.read_text(encoding='utf-8').strip('\n') not in shown:
            page.problem(1, 'does not show test/library/%s as it is' % path.name)


# ------------------------------------------------------------------ names of files

def check_paths(page):
    for block in page.blocks:
        pieces = [(block.line + k, line) for k, line in enumerate(block.lines)] if block.kind == 'code' \
            else markdown.inline_code(block)
        for line, text in pieces:
            for path in PATH.findall(text):
                path = re.sub(r'[.,:;]+$', '', path)
                path = path if path.count('{') == path.count('}') else path[:path.find('{')]
                if not placeholder(path) and path != WORKSPACE and not page.repository.exists(path):
                    page.problem(line, 'path %s is not there' % path)
            for path in ROOM_FILE.findall(text):
                if not any((page.repository.root / base / path).exists() for base in ('include/slender_sim', 'src')):
                    page.problem(line, 'neither include/slender_sim/ nor src/ has %s' % path)
            for name in re.findall(r'(?<![\w/.])slender_sim/([A-Z]\w+)', text):
                if name not in page.repository.interfaces:
                    page.problem(line, 'there is no message or service slender_sim/%s' % name)


def placeholder(path):
    """Whether a part of the path is a word in capitals for what the reader puts there."""
    return '...' in path or any(re.fullmatch(r'[A-Z]+[A-Z_]*(\.\w+)?', p) and p != 'README.md' for p in path.split('/'))


# ------------------------------------------------------------------ commands

def check_commands(page):
    for block in page.blocks:
        if block.kind == 'code':
            if block.language in SHELL and not is_yaml(block):
                for line, text in joined_lines(block):
                    check_command_line(page, line, text)
        else:
            for line, text in markdown.inline_code(block):
                check_command_line(page, line, text)
                check_node_name(page, line, text)


def joined_lines(block):
    line, text = None, ''
    for k, piece in enumerate(block.lines):
        line = block.line + k if line is None else line
        text += piece
        if text.endswith('\\'):
            text = text[:-1] + ' '
            continue
        yield line, text
        line, text = None, ''


def check_command_line(page, line, text):
    text = re.sub(r'^\s*\$ ', '', text)
    try:
        lexer = shlex.shlex(text, posix=True, punctuation_chars='|&;<>')
        lexer.whitespace_split, lexer.commenters = True, ''
        words = list(lexer)
    except ValueError:
        words = text.split()
    command = []
    for word in words + [';']:
        if word.startswith('#') or re.fullmatch(r'[|&;<>]+', word):
            check_command(page, line, command)
            command = []
            if word.startswith('#'):
                break
        else:
            command.append(word)


def check_command(page, line, words):
    repository = page.repository
    while words and re.match(r'[A-Z_]+=|(time|nice|sudo|env|then|do)$', words[0]):
        words = words[1:]
    if not words:
        return
    if words[0] == 'roslaunch':
        return check_launch(page, line, words[1:])
    if words[0] == 'rosrun':
        if len(words) < 3 or words[1] != 'slender_sim':
            return
        if words[2] not in repository.programs:
            if not placeholder(words[2]):
                page.problem(line, 'there is no program %s' % words[2])
            return
        words = words[2:]
    program = words[0].split('/')[-1] if '/lib/slender_sim/' in words[0] else words[0]
    if program in repository.programs:
        check_program(page, line, program, words[1:])
    elif re.match(r'(?:\./)?(?:scripts|test)/', program):
        script = repository.root / program
        if script.is_file():
            for option in options_of(words[1:]):
                if option not in script.read_text(encoding='utf-8', errors='replace'):
                    page.problem(line, '%s has no option %s' % (program, option))


def options_of(words):
    return [re.sub(r'[=,.:]+.*$', '', w) for w in (word.strip('[]()') for word in words) if re.match(r'--[a-z]', w)]


def check_program(page, line, program, words):
    repository = page.repository
    for option in options_of(words):
        if not any(option == o for o in repository.options(program)):
            page.problem(line, '%s has no option %s' % (program, option))
    if program == 'study' and words and words[0] in ('run', 'check', 'report'):
        for name in study_names(words[1:]):
            if name not in repository.studies:
                page.problem(line, 'there is no study %s' % name)
    for k, word in enumerate(words):
        if word == '--set' and k + 1 < len(words):
            check_override(page, line, words[k + 1])
        parameter = re.match(r'_([a-z]\w*):=', word)
        if parameter and parameter.group(1) not in repository.node_names:
            page.problem(line, 'no node has a parameter ~%s' % parameter.group(1))


def check_studies(page):
    """docs/studies.md has every study, in the first columns of tables with the heading Study, and none that is not there."""
    if page.name != 'docs/studies.md':
        return
    named = {}
    for block in page.blocks:
        if block.kind == 'table' and re.match(r'\|\s*Study\s*\|', block.lines[0]):
            for k, row in enumerate(block.lines):
                named.update((name, block.line + k) for name in re.findall(r'`(\w+)`', row.split('|')[1]))
    for name, line in named.items():
        if name not in page.repository.studies:
            page.problem(line, 'there is no study %s' % name)
    for name in sorted(page.repository.studies - set(named) - {'all'}):
        page.problem(1, 'study %s is in no table' % name)


def study_names(words):
    skip = False
    for word in words:
        if skip or word.startswith('-'):
            skip = word in ('--json', '--out', '--jobs', '--xml')
        elif re.fullmatch(r'[a-z]\w*', word):
            yield word


def check_override(page, line, text):
    path = text.split('=')[0]
    if not re.fullmatch(r'[a-z_]\w*(\.\w+)*', path):
        return
    value = parse_yaml(text.partition('=')[2]) if '=' in text else None
    for part in reversed(path.split('.')):
        value = {part: value}
    if page.repository.keys.unknown(value, anywhere=False):
        page.problem(line, 'docs/scene_reference.md has no key %s' % path)


def check_launch(page, line, words):
    files = [w for w in words if w.endswith('.launch')]
    if not files or 'slender_sim' not in words and not files[0].startswith('launch/'):
        return
    name = files[0].split('/')[-1]
    arguments = page.repository.launch_arguments.get(name)
    if arguments is None:
        if not placeholder(name):
            page.problem(line, 'there is no launch file %s' % name)
        return
    for word in words:
        argument = re.match(r'(\w+):=(.*)', word, re.S)
        if argument and argument.group(1) not in arguments:
            page.problem(line, '%s has no argument %s' % (name, argument.group(1)))
        elif argument and argument.group(1) == 'set':
            for override in argument.group(2).strip('[]').split(','):
                check_override(page, line, override.strip())


def check_node_name(page, line, text):
    """Parameters and services of nodes (~name), arguments of launch files (name:=value), options without a program."""
    match = re.match(r'~([a-z_]+)(?=$|[\s:,])', text)
    if match and match.group(1) not in page.repository.node_names:
        page.problem(line, 'no node has a parameter or service ~%s' % match.group(1))
    match = re.match(r'(\w+):=', text)
    if match and not match.group(1).startswith('_') \
            and not any(match.group(1) in a for a in page.repository.launch_arguments.values()):
        page.problem(line, 'no launch file has an argument %s' % match.group(1))


# ------------------------------------------------------------------ keys of scenes

def is_yaml(block):
    """Whether indented or unnamed code is YAML: its first line is a key, and all of it a mapping or a list of mappings."""
    first = next((line for line in block.lines if line.strip()), '')
    if block.language or not re.match(r'\s*(?:- )?[{]?[a-z_][\w.]*:(?:\s|$)', first):
        return False
    return contains_mapping(parse_yaml(block.text))


def check_keys(page):
    for block in page.blocks:
        if block.kind == 'code':
            if block.language in ('yaml', 'yml'):
                value = parse_yaml(block.text)
                if value is None:
                    page.problem(block.line, 'this code is no YAML')
                else:
                    check_value(page, block.line, value)
            elif is_yaml(block):
                check_value(page, block.line, parse_yaml(block.text))
        else:
            for line, text in markdown.inline_code(block):
                check_inline_key(page, line, text)


def check_value(page, line, value):
    keys, plan_keys = page.repository.keys, page.repository.plan_keys
    if isinstance(value, dict) and 'axes' in value:
        for key in value:
            if key not in plan_keys:
                page.problem(line, 'plans of sweeps have no key %s' % key)
        for path in value['axes'] or {}:
            check_override(page, line, str(path))
        return
    entries = value if isinstance(value, list) else [value]
    for entry in entries:
        for key in keys.unknown(entry):
            page.problem(line, 'docs/scene_reference.md has no key %s where the other keys of this code are' % key)


def check_inline_key(page, line, text):
    if text in NOT_SCENES or FILE_NAME.search(text):
        return
    if re.fullmatch(r'[a-z_]+(\.(\w+))+(=.*)?', text, re.S):
        path = text.split('=')[0]
        value = parse_yaml(text.partition('=')[2]) if '=' in text else None
        for part in reversed(path.split('.')):
            value = {part: value}
    elif re.match(r'\{?[a-z_][\w.]*: \S', text) or re.match(r'\{[a-z_]+[,}]', text):
        value = parse_yaml(text)
        if not isinstance(value, dict) or all(str(key) in page.repository.fields for key in value):
            return
    else:
        return
    for key in page.repository.keys.unknown(value):
        page.problem(line, '`%s`: docs/scene_reference.md has no such key (%s)' % (text, key))


# ------------------------------------------------------------------ the change log

def check_changelog(repository):
    problems, entry, start = [], 0, 0
    path = repository.root / 'CHANGELOG.rst'
    for k, line in enumerate(path.read_text(encoding='utf-8').split('\n'), 1):
        if len(line) > WIDTH:
            problems.append('CHANGELOG.rst:%d: line of %d columns; at most %d' % (k, len(line), WIDTH))
        if line.startswith('* '):
            entry, start = 1, k
        elif line.startswith('  ') and line.strip() and entry:
            entry += 1
            if entry == ENTRY + 1:
                problems.append('CHANGELOG.rst:%d: entry of more than %d lines' % (start, ENTRY))
        else:
            entry = 0
    return problems


RULES = [check_width, check_paragraphs, check_size, check_opening, check_links, check_index, check_programs, check_paths, check_commands, check_studies, check_keys]


def check(repository, names, rules=RULES):
    """Problems of these pages. Names in generated pages are those of their generators: only form and links are checked."""
    problems = []
    for name in names:
        page = Page(repository, name)
        for rule in rules:
            if name not in GENERATED or rule in (check_width, check_opening, check_links, check_index):
                rule(page)
        problems += page.problems
    return problems


def main(words):
    root = Path(__file__).resolve().parents[2]
    repository = Repository(root)
    if '--self-test' in words:
        import broken_documents
        if not broken_documents.passes():
            return 1
    names = [w for w in words if not w.startswith('--')]
    pages = names or ['README.md'] + sorted(str(p.relative_to(root)) for p in root.glob('docs/*.md'))
    problems = check(repository, pages)
    if not names:
        problems += check_changelog(repository)
    print('\n'.join(problems))
    print('%d pages, %d problems' % (len(pages), len(problems)))
    return 1 if problems else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
