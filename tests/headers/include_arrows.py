#!/usr/bin/env python3
"""Checks who includes whom in hiprt_device, hiprt_build and tools, module by module.

    include_arrows.py ROOT             exit 0, or 1 with one line per forbidden include
    include_arrows.py --expect ROOT    the forbidden includes must be exactly the lines that say '// expect'

A module is a folder, or some files of one. MAY_INCLUDE says which modules it may include besides itself. Headers
directly in hiprt_build, in its folders gpu and format, and host/host_part.h are public; other headers of hiprt_build
are not installed. Public headers and .cpp files of hiprt_build must compile without a GPU runtime: they include none.
"""
import os
import re
import sys

# The longest prefix decides.
MODULES = {
    'hiprt_device/format/': 'format',
    'hiprt_device/math/': 'math',
    'hiprt_device/scene_view.h': 'scene',
    'hiprt_device/ray.h': 'ray',
    'hiprt_device/host_scene.h': 'host_scene',
    'hiprt_device/filter.h': 'ray',
    'hiprt_device/intersect/': 'intersect',
    'hiprt_device/instances/': 'instances',
    'hiprt_device/primitives/': 'primitives',
    'hiprt_device/traverse/': 'traverse',
    'hiprt_device/query/': 'query',
    'hiprt_device/compat/': 'compat',
    'hiprt_device/': 'query',
    'hiprt_build/format/': 'host_format',
    'hiprt_build/host/': 'host',
    'hiprt_build/trace_rays.h': 'host',
    'hiprt_build/gpu/': 'gpu',
    'hiprt_build/rtc/': 'rtc',
    'hiprt_build/hiprt_api/': 'hiprt_api',
    'hiprt_build/python/': 'python',
    'hiprt_build/': 'build',
    'tools/base/': 'base',
    'tools/scene_io/': 'scene_io',
    'tools/build/': 'scene_build',
    'tools/parts/': 'parts',
    'tools/distributed/': 'distributed',
    'tools/render/image/': 'image',
    'tools/render/scene/': 'render_scene',
    'tools/render/tracers/': 'tracers',
    'tools/render/studio/': 'studio',
    'tools/render/path/': 'path',
    'tools/render/units/': 'units',
    'tools/render/parts/': 'render_parts',
    'tools/render/': 'path',
    'tools/': 'cli',
}
DEVICE_MODULES = ('format', 'math', 'scene', 'ray', 'host_scene', 'intersect', 'instances', 'primitives', 'traverse',
                  'query')
# Public headers of hiprt_build that hiprt::format compiles.
FORMAT_HEADERS = {f'hiprt_build/{name}.h' for name in ('buffer', 'error', 'export', 'file', 'open_scene',
                                                        'trace_rays')}
LIBRARY = {*DEVICE_MODULES, 'host_format', 'host', 'build', 'gpu'}
MAY_INCLUDE = {
    'format': set(),
    'math': {'format'},
    'scene': {'format', 'math'},
    'ray': {'format', 'math'},
    'host_scene': {'format', 'math', 'scene', 'ray'},
    'intersect': {'format', 'math', 'scene', 'ray'},
    'instances': {'format', 'math', 'scene', 'ray', 'intersect'},
    'primitives': {'format', 'math', 'scene', 'ray', 'intersect', 'instances'},
    'traverse': {'format', 'math', 'scene', 'ray', 'host_scene', 'intersect', 'instances', 'primitives'},
    'query': set(DEVICE_MODULES),
    # HIPRT's names over the queries. Nothing of the library needs them.
    'compat': set(DEVICE_MODULES),
    # instances: only_instance.h makes the PlacedObject that kernels take.
    'host_format': {'format', 'math', 'scene', 'instances'},
    # Tracers compiled for the host. Only views are made here.
    'host': {*DEVICE_MODULES, 'host_format'},
    'build': {'format', 'math', 'scene', 'host_format', 'host', 'gpu'},
    'gpu': {'format', 'math', 'scene', 'host_format', 'host', 'build'},
    'rtc': {'host_format', 'build', 'gpu'},
    # The library in libhiprt's place. Nothing needs it.
    'hiprt_api': LIBRARY | {'rtc', 'compat'},
    # The Python module. Nothing needs it.
    'python': LIBRARY | {'rtc'},
    'base': LIBRARY,
    'scene_io': LIBRARY | {'base'},
    'scene_build': LIBRARY | {'base', 'scene_io'},
    'parts': LIBRARY | {'base', 'scene_io', 'scene_build'},
    'distributed': LIBRARY | {'base'},
    'image': LIBRARY | {'base', 'scene_io'},
    'render_scene': LIBRARY | {'base', 'scene_io'},
    'tracers': LIBRARY | {'base', 'render_scene'},
    'studio': LIBRARY | {'base', 'scene_io', 'image', 'render_scene', 'tracers'},
    'path': LIBRARY | {'base', 'scene_io', 'image', 'render_scene', 'tracers', 'studio'},
    'units': LIBRARY | {'base', 'image', 'render_scene', 'tracers', 'studio', 'path'},
    'render_parts': LIBRARY | {'base', 'scene_io', 'parts', 'image', 'render_scene', 'tracers', 'studio', 'path',
                               'units'},
    'cli': LIBRARY | {'base', 'scene_io', 'scene_build', 'parts', 'distributed', 'image', 'render_scene', 'tracers',
                      'studio', 'path', 'units', 'render_parts'},
}
# A folder of the include path of programs that include <hiprt/...>.
COMPAT = 'hiprt_device/compat/'
# Includes of other packages that are allowed in some modules only.
GPU = re.compile(r'(hip|cuda|cub|rocprim|thrust)(/|_|\.)')
ENGINES = re.compile(r'(tbb|oneapi|embree3|nlohmann)/')
BINDINGS = re.compile(r'(nanobind|pybind11)/|Python\.h')
INCLUDE = re.compile(r'^\s*#\s*include\b\s*(.*)$')
NAME = re.compile(r'^([<"])([^>"]+)[>"]')


def module(path):
    """The module of a file; None outside of the three folders."""
    for prefix in sorted(MODULES, key=len, reverse=True):
        if path == prefix or prefix.endswith('/') and path.startswith(prefix):
            return MODULES[prefix]
    return None


def is_public(path):
    """Whether a header of hiprt_build is installed."""
    return path.endswith('.h') and (module(path) in ('gpu', 'host_format') or path == 'hiprt_build/host/host_part.h' or
                                    module(path) in ('build', 'host') and path.count('/') == 1)


def sources(root):
    for top in ('hiprt_device', 'hiprt_build', 'tools'):
        for folder, folders, names in os.walk(os.path.join(root, top)):
            folders.sort()
            for name in sorted(names):
                if name.endswith(('.h', '.cpp', '.hip', '.cu')):
                    yield os.path.relpath(os.path.join(folder, name), root)


def includes(root, path):
    """Yields (line number, name, quoted) of each #include; name is None where it is not a plain one."""
    with open(os.path.join(root, path), encoding='utf-8') as f:
        text = f.read()
    # Comments go, line numbers stay.
    text = re.sub(r'/\*.*?\*/', lambda m: '\n' * m.group().count('\n'), text, flags=re.S)
    for number, line in enumerate(text.splitlines(), 1):
        match = INCLUDE.match(line)
        if match:
            name = NAME.match(match.group(1))
            yield number, name and name.group(2), bool(name) and name.group(1) == '"'


def resolve(root, path, name, quoted):
    """The included file relative to the root, or None where it is not one of the project."""
    if quoted:
        near = os.path.normpath(os.path.join(os.path.dirname(path), name))
        if os.path.isfile(os.path.join(root, near)):
            return near
    if name.startswith('hiprt/'):
        name = COMPAT + name
    return name if os.path.isfile(os.path.join(root, name)) else None


def fault(root, path, name, quoted):
    """Why `path` may not include `name`, or None."""
    if name is None:
        return 'include of a macro: the arrows cannot be seen'
    mine = module(path)
    target = resolve(root, path, name, quoted)
    public = is_public(path)
    # Compiled where there is no GPU runtime.
    host_only = mine in ('build', 'host_format', 'host') and (public or path.endswith('.cpp'))
    if target is None:
        if quoted or name.startswith(('hiprt_device/', 'hiprt_build/', 'hiprt/', 'tools/')):
            return f'{name} does not exist in the project'
        if name.startswith('glm/') and path not in ('hiprt_device/math/vec.h', 'hiprt_device/math/vec_functions.h'):
            return 'only hiprt_device/math/vec.h and vec_functions.h include GLM'
        if mine == 'compat' and path not in (COMPAT + 'hiprt/hiprt_common.h', COMPAT + 'hiprt/hiprtew.h'):
            return 'in hiprt_device/compat only hiprt_common.h and hiprtew.h include other packages'
        in_device = mine in DEVICE_MODULES
        if in_device and not GPU.match(name) and not name.startswith('glm/') and \
                path not in ('hiprt_device/format/standard.h', 'hiprt_device/math/lanes.h') and not ENGINES.match(name):
            return 'in hiprt_device only format/standard.h includes the standard library, lanes.h vector registers'
        if GPU.match(name) and in_device and path != 'hiprt_device/format/portability.h':
            return 'in hiprt_device only format/portability.h includes a GPU runtime'
        if GPU.match(name) and host_only:
            return f'{name} is not there for a C++ compiler alone'
        if BINDINGS.match(name) and mine != 'python':
            return 'only hiprt_build/python includes Python'
        if ENGINES.match(name) and (in_device or public):
            return f'{name} would become a dependency of every user: public headers do not include it'
        return None
    theirs = module(target)
    if theirs == 'gpu' and host_only:
        return f'{target} needs a GPU runtime, which a C++ compiler alone does not have'
    if public and theirs == 'build' and not is_public(target):
        return f'{target} is internal and not installed: public headers do not include it'
    if mine in ('host_format', 'host') and target in FORMAT_HEADERS:
        return None
    if theirs != mine and theirs not in MAY_INCLUDE[mine]:
        return f'{mine} may not include {theirs or "tests, benchmarks or others"} ({target})'
    return None


def cycles(graph):
    """Yields each file that includes itself through others, as the list of files of the cycle."""
    state = {}

    def visit(node, path):
        state[node] = 'open'
        for target in graph.get(node, ()):
            if state.get(target) == 'open':
                yield path[path.index(target):] + [target]
            elif target not in state:
                yield from visit(target, path + [target])
        state[node] = 'done'

    for node in sorted(graph):
        if node not in state:
            yield from visit(node, [node])


def check(root):
    """Returns (number of files, {(path, line): reason})."""
    found, graph, count = {}, {}, 0
    for path in sources(root):
        count += 1
        for number, name, quoted in includes(root, path):
            reason = fault(root, path, name, quoted)
            if reason:
                found[path, number] = reason
                continue
            target = resolve(root, path, name, quoted)
            if target:
                graph.setdefault(path, []).append(target)
    for path in cycles(graph):
        last, first = path[-2], path[-1]
        number = next(n for n, name, q in includes(root, last) if name and resolve(root, last, name, q) == first)
        found.setdefault((last, number), 'circle: ' + ' -> '.join(path))
    return count, found


def expected(root):
    for path in sources(root):
        with open(os.path.join(root, path), encoding='utf-8') as f:
            for number, line in enumerate(f, 1):
                if '// expect' in line:
                    yield path, number


def main(arguments):
    expect = arguments[:1] == ['--expect']
    if len(arguments) != 1 + expect:
        print(__doc__, file=sys.stderr)
        return 2
    root = os.path.abspath(arguments[-1])
    count, found = check(root)
    if count == 0:
        print(f'no source found under {root}', file=sys.stderr)
        return 1
    if expect:
        wanted = set(expected(root))
        for path, number in sorted(wanted - set(found)):
            print(f'{path}:{number}: a forbidden include was not seen')
        for path, number in sorted(set(found) - wanted):
            print(f'{path}:{number}: refused by mistake: {found[path, number]}')
        print(f'{len(wanted)} forbidden includes expected, {len(found)} found in {count} files')
        return int(set(found) != wanted or not wanted)
    for (path, number), reason in sorted(found.items()):
        print(f'{path}:{number}: {reason}')
    print(f'{count} files, {len(found)} forbidden includes')
    return int(bool(found))


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
