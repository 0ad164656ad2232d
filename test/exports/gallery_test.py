#!/usr/bin/python3
"""scripts/gallery makes a page whose films show something. gallery_test.py FOLDER_OF_PROGRAMS"""
import html.parser
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PROGRAMS = sys.argv.pop()


def gallery(out, *words):
    return subprocess.run([str(ROOT / 'scripts' / 'gallery'), '--programs', PROGRAMS, '--out', str(out)] + list(words),
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)


class Page(html.parser.HTMLParser):
    """Files, texts and factors of each article."""

    def __init__(self, path):
        super().__init__()
        self.articles, self.in_factor, self.article = {}, False, None
        self.feed(path.read_text(encoding='utf-8'))

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag == 'article':
            self.article = self.articles[attributes['id']] = {'files': [], 'text': '', 'kind': attributes['class']}
        if self.article is not None and 'src' in attributes:
            self.article['files'].append(attributes['src'])
        self.in_factor = attributes.get('class') == 'factor'

    def handle_data(self, text):
        if self.article is not None:
            self.article['text'] += text
            if self.in_factor:
                self.article['factor'] = float(text)

    def handle_endtag(self, tag):
        self.in_factor = False
        if tag == 'article':
            self.article = None


def colours(film, width=480, height=270):
    """Of the first and the last picture of a film: the pixels that have a colour. Background, floors and holders are grey."""
    raw = subprocess.run(['ffmpeg', '-v', 'error', '-i', str(film), '-f', 'rawvideo', '-pix_fmt', 'rgb24', '-'],
                         stdout=subprocess.PIPE, check=True).stdout
    size = 3 * width * height
    assert raw and len(raw) % size == 0, 'not %d x %d pixels' % (width, height)
    return [{k for k in range(0, size, 3) if max(p[k:k + 3]) - min(p[k:k + 3]) > 30} for p in (raw[:size], raw[-size:])]


class Gallery(unittest.TestCase):
    def test_two_scenes(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder)
            run = gallery(out, 'cantilever', 'boxes_and_balls')
            self.assertEqual(run.returncode, 0, run.stdout)
            articles = Page(out / 'index.html').articles
            self.assertEqual(sorted(articles), ['boxes_and_balls', 'cantilever'])
            for name, article in articles.items():
                self.assertGreater(article['factor'], 0)
                self.assertIn('simulate config/scenes/%s.yaml' % name, article['text'])
                self.assertIn('--bag out/%s.bag' % name, article['text'])
                self.assertIn('name: ' + name, article['text'])   # the YAML
                self.assertEqual(len(article['files']), 2)
                for file in article['files']:
                    self.assertGreater((out / file).stat().st_size, 1000)
                self.assertLessEqual((out / article['files'][1]).stat().st_size, 300_000)
                first, last = colours(out / article['files'][1])
                # a thousandth of the picture: the cantilever is three pixels wide and 250 long
                self.assertGreater(min(len(first), len(last)), 130)
                self.assertGreater(len(first ^ last), 130, 'nothing moves')
            # goes on where it stopped
            times = {file: (out / file).stat().st_mtime_ns for article in articles.values() for file in article['files']}
            self.assertEqual(gallery(out, 'cantilever', 'boxes_and_balls').returncode, 0)
            self.assertEqual(times, {file: (out / file).stat().st_mtime_ns for file in times})

    def test_a_scene_that_fails_is_shown(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder)
            bad = out / 'bad.yaml'
            bad.write_text('# A <b>bad</b> scene.\nname: bad\nrods: [{lenght: 3}]\n')
            run = gallery(out, str(bad), 'cantilever')
            self.assertEqual(run.returncode, 1, run.stdout)
            articles = Page(out / 'index.html').articles
            self.assertEqual((articles['bad']['kind'], articles['cantilever']['kind']), ('failed', 'done'))
            self.assertRegex(articles['bad']['text'], r'lenght')
            self.assertIn('A <b>bad</b> scene.', articles['bad']['text'])

    def test_a_long_scene_is_cut(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder)
            run = gallery(out, 'plectoneme', '--wall', '1')   # of 12 s, half of real time at best
            self.assertEqual(run.returncode, 0, run.stdout)
            article = Page(out / 'index.html').articles['plectoneme']
            self.assertRegex(article['text'], r'cut, the scene lasts 12 s')
            self.assertGreater(article['factor'], 0)

    def test_bad_input(self):
        for words in (['no_such_scene'], ['--jobs', '0'], ['cantilever', '--programs', '/nowhere']):
            self.assertEqual(gallery('/nowhere/out', *words).returncode, 2, words)
        self.assertFalse(os.path.exists('/nowhere'))


if __name__ == '__main__':
    unittest.main(verbosity=2)
