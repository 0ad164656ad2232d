"""Divides a Markdown page into headings, paragraphs, tables and code, with the numbers of their lines."""
import re
from dataclasses import dataclass, field

FENCE = re.compile(r'^(\s*)(```+|~~~+)\s*([\w+-]*)')
HEADING = re.compile(r'^(#{1,6})\s+(.*?)\s*#*$')
ITEM = re.compile(r'^(\s*)([-*+]|\d+[.)])(\s+)')
INLINE_CODE = re.compile(r'(?<!`)(`+)(?!`)(.+?)(?<!`)\1(?!`)', re.S)


@dataclass
class Block:
    kind: str                 # heading, paragraph, table, code, html
    line: int                 # number of its first line, from 1
    lines: list = field(default_factory=list)
    language: str = ''        # of fenced code
    level: int = 0            # of headings

    @property
    def text(self):
        return '\n'.join(self.lines)


def blocks(text):
    """The blocks of a page in their order. Each item of a list is a paragraph of its own."""
    found, lines = [], text.split('\n')
    content = 0               # indentation of the text of the list that is open; 0: none is
    k, current = 0, None
    after_blank = True
    while k < len(lines):
        line = lines[k]
        indent = len(line) - len(line.lstrip(' '))
        fence, heading, item = FENCE.match(line), HEADING.match(line), ITEM.match(line)
        if not line.strip():
            current, after_blank = None, True
            k += 1
            continue
        if after_blank and indent < content and not item:
            content = 0
        if fence:
            block = Block('code', k + 2, [], fence.group(3))
            k += 1
            while k < len(lines) and not lines[k].strip().startswith(fence.group(2)):
                block.lines.append(lines[k][len(fence.group(1)):])
                k += 1
            found.append(block)
            current = None
        elif indent >= content + 4 and (after_blank or (current and current.kind == 'code')):
            if found and found[-1].kind == 'code' and not found[-1].language and indented_before(lines, k, content):
                found[-1].lines += [''] * (k + 1 - found[-1].line - len(found[-1].lines))
                current = found[-1]
            else:
                current = Block('code', k + 1)
                found.append(current)
            current.lines.append(line[content + 4:])
        elif heading:
            found.append(Block('heading', k + 1, [heading.group(2)], level=len(heading.group(1))))
            current, content = None, 0
        elif line.lstrip().startswith('|'):
            if not current or current.kind != 'table':
                current = Block('table', k + 1)
                found.append(current)
            current.lines.append(line)
        elif line.lstrip().startswith('<') and (not current or current.kind == 'html'):
            if not current:
                current = Block('html', k + 1)
                found.append(current)
            current.lines.append(line)
        elif item or not current or current.kind != 'paragraph':
            if item:
                content = len(item.group(0))
            current = Block('paragraph', k + 1, [line])
            found.append(current)
        else:
            current.lines.append(line)
        after_blank = False
        k += 1
    return found


def indented_before(lines, k, content):
    """Whether the last line before k that is not blank belongs to the same indented code."""
    k -= 1
    while k >= 0 and not lines[k].strip():
        k -= 1
    return k >= 0 and lines[k].startswith(' ' * (content + 4))


def inline_code(block):
    """(line, text) of what stands in backticks in a paragraph, a table or a heading."""
    for match in INLINE_CODE.finditer(block.text):
        line = block.line + block.text.count('\n', 0, match.start())
        yield line, re.sub(r'\s*\n\s*', ' ', match.group(2)).replace('\\|', '|').strip()


def slug(heading, seen):
    """The anchor that GitHub gives to a heading."""
    text = re.sub(r'!?\[([^\]]*)\]\([^)]*\)', r'\1', heading).replace('`', '')
    text = re.sub(r'[^\w\- ]', '', text.lower()).replace(' ', '-')
    count = seen.get(text, 0)
    seen[text] = count + 1
    return text if count == 0 else '%s-%d' % (text, count)


def anchors(page):
    seen = {}
    found = {slug(b.lines[0], seen) for b in page if b.kind == 'heading'}
    for b in page:
        if b.kind in ('html', 'paragraph'):
            found.update(re.findall(r'<\w+[^>]*\b(?:id|name)="([^"]+)"', b.text))
    return found
