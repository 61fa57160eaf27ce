# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options of the command line made from the configuration of the matcher, and back."""
import argparse
from dataclasses import fields, replace

from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES

USUAL_PROFILE = 'realtime'


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
