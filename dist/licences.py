#!/usr/bin/env python3
"""Lists the crates that a program for a target is made of, with their licences and the texts of these, as Markdown on standard output.

    dist/licences.py TARGET > THIRD-PARTY.md
"""
import json, pathlib, subprocess, sys

def packages(target):
    """Crates that are linked into the program, but for those of this workspace."""
    metadata = json.loads(subprocess.check_output(['cargo', 'metadata', '--format-version', '1', '--locked', '--filter-platform', target]))
    nodes = {node['id']: node for node in metadata['resolve']['nodes']}
    known, left = set(), [metadata['resolve']['root']]
    while left:
        at = left.pop()
        if at in known:
            continue
        known.add(at)
        # Without those of tests and of build scripts, whose kind is not null.
        left += [dep['pkg'] for dep in nodes[at]['deps'] if any(kind['kind'] is None for kind in dep['dep_kinds'])]
    members = set(metadata['workspace_members'])
    return sorted((p for p in metadata['packages'] if p['id'] in known - members), key=lambda p: (p['name'], p['version']))

def texts(package):
    """Texts of licences and notices that lie beside a crate's manifest."""
    folder = pathlib.Path(package['manifest_path']).parent
    names = ('LICENSE', 'LICENCE', 'COPYING', 'NOTICE', 'UNLICENSE')
    files = sorted(path for path in folder.iterdir() if path.is_file() and path.name.upper().startswith(names))
    return [path.read_text(errors='replace').strip() for path in files]

def main():
    crates = packages(sys.argv[1])
    print('# Crates that this program is made of\n\n| crate | version | licence | source |\n|---|---|---|---|')
    for p in crates:
        print(f"| {p['name']} | {p['version']} | {p['license'] or 'see below'} | {p['repository'] or ''} |")
    users = {}
    for p in crates:
        for text in texts(p):
            users.setdefault(text, []).append(p['name'])
    for text, names in users.items():
        print(f"\n## {', '.join(names)}\n\n```text\n{text}\n```")

if __name__ == '__main__':
    main()
