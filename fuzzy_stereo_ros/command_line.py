# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The command `fuzzy-stereo`, and options of the command line made from the configuration.

Exit codes: 0 done; 1 a saved pair does not come out as it was; 2 bad input, said in one sentence
on standard error, nothing written; 130 interrupted by the user.
"""
import argparse
from dataclasses import fields, replace
import sys

from fuzzy_stereo_ros import benchmark_command, match_command
from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES

BAD_INPUT = 2
INTERRUPTED = 130
USUAL_PROFILE = 'realtime'


def main(argv=None):
    """Run `fuzzy-stereo` with the arguments (None: those of the process); return its exit code."""
    parser = Parser(prog='fuzzy-stereo',
                    description='Dense stereo by a genetic algorithm with a fuzzy fitness.')
    commands = parser.add_subparsers(title='commands', metavar='COMMAND', required=True)
    match = commands.add_parser(
        'match', help='match two images', description=match_command.DESCRIPTION,
        epilog=match_command.EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    match_command.add_arguments(match)
    add_matcher_options(match, required=('disparities',))
    match.set_defaults(run=_match, profile=None)    # a saved pair must know whether it is given
    benchmark = commands.add_parser(
        'benchmark', help='measure the matcher side by side with OpenCV',
        description=benchmark_command.DESCRIPTION, epilog=benchmark_command.EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    benchmark_command.add_arguments(benchmark)
    add_matcher_options(benchmark, left_out=benchmark_command.DECIDED)
    benchmark.set_defaults(run=lambda arguments: benchmark_command.run(
        arguments, matcher_changes(arguments), sys.stdout))
    return run_cleanly(parser, argv)


def _match(arguments):
    if arguments.saved is not None:
        saved = match_command.read_saved(arguments)
        return match_command.run(
            arguments, matcher_config(arguments, saved.repeatable), sys.stdout, saved)
    arguments.profile = arguments.profile or USUAL_PROFILE
    return match_command.run(arguments, matcher_config(arguments), sys.stdout)


class Parser(argparse.ArgumentParser):
    """A parser that takes no abbreviations and reports an error in one line."""

    def __init__(self, **options):
        super().__init__(allow_abbrev=False, **options)

    def error(self, message):
        self.exit(BAD_INPUT, f'{self.prog}: {message}\n')

    def waive(self, *names):
        """Let arguments be left out that are required otherwise."""
        for action in self._actions:
            if action.dest in names:
                action.required = False


def run_cleanly(parser, argv):
    """
    Parse the arguments, call what they set as `run`, and return the exit code.

    A ValueError or OSError is bad input: its text is the one sentence the user reads.
    """
    try:
        arguments = parser.parse_args(argv)
        return arguments.run(arguments) or 0
    except (ValueError, OSError) as error:
        print(f'{parser.prog}: {error}', file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED


def add_matcher_options(parser, required=(), left_out=()):
    """
    Add --profile and an option for each parameter of the configuration, for matcher_config.

    required, left_out: names of parameters that must be given, and that have no option.
    """
    group = parser.add_argument_group(
        'the matcher', 'a profile sets all parameters, an option changes one of them')
    group.add_argument('--profile', choices=tuple(PROFILES), default=USUAL_PROFILE,
                       help=f'default: {USUAL_PROFILE}')
    for parameter in fields(MatcherConfig):
        if parameter.name in left_out:
            continue
        needed = parameter.name in required
        options = {'default': argparse.SUPPRESS, 'required': needed,
                   'help': _help(parameter, needed)}
        if parameter.type is bool:
            options['action'] = argparse.BooleanOptionalAction
        elif parameter.type is str:
            options['choices'] = parameter.metadata['choices']
        else:
            options.update(type=parameter.type,
                           metavar='N' if parameter.type is int else 'NUMBER')
        group.add_argument(option_name(parameter.name), **options)


def matcher_config(arguments, saved=None):
    """
    Return the configuration that parsed options ask for; ValueError where it is not allowed.

    saved: MatcherConfig that they change; a profile then keeps its range of disparities.
    """
    changes = matcher_changes(arguments)
    if saved is None:
        return MatcherConfig.from_profile(arguments.profile, **changes)
    if arguments.profile is not None:
        saved = MatcherConfig.from_profile(arguments.profile, disparities=saved.disparities,
                                           min_disparity=saved.min_disparity)
    return replace(saved, **changes)


def matcher_changes(arguments):
    """Return {parameter: value} of the parameters that were given as options."""
    return {parameter.name: getattr(arguments, parameter.name)
            for parameter in fields(MatcherConfig) if hasattr(arguments, parameter.name)}


def option_name(parameter):
    """Return the option that sets a parameter: `min_disparity` is --min-disparity."""
    return '--' + parameter.replace('_', '-')


def _help(parameter, required):
    """Return the sentence, unit, range and default of a parameter, as argparse wants it."""
    facts = [parameter.metadata['sentence']]
    if 'low' in parameter.metadata:
        low, high, unit = (parameter.metadata[key] for key in ('low', 'high', 'unit'))
        facts.append(f'{written_value(low)} to {written_value(high)} {unit}'.rstrip())
    values = {name: getattr(MatcherConfig.from_profile(name), parameter.name)
              for name in PROFILES}
    if len(set(values.values())) == 1:
        facts.append(f"default: {written_value(values['realtime'])}")
    else:
        facts.append('default: ' + ', '.join(f'{written_value(value)} ({name})'
                                             for name, value in values.items()))
    return '; '.join(facts[:-1] if required else facts).replace('%', '%%')


def written_value(value):
    """Return a parameter's value as people write it: on, off, 54 instead of 54.0."""
    if isinstance(value, bool):
        return 'on' if value else 'off'
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


if __name__ == '__main__':
    sys.exit(main())
