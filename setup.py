# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Package the node and the matcher; package.xml is where name, version and the like are said."""
from glob import glob
from xml.etree import ElementTree

from setuptools import Distribution, find_packages, setup

manifest = ElementTree.parse('package.xml').getroot()
package_name = manifest.findtext('name')
maintainer = manifest.find('maintainer')


class DistributionWithDataFiles(Distribution):
    # The editable install asks for has_data, defined nowhere, and leaves the data files out.
    def has_data(self):
        return self.has_data_files()


setup(
    distclass=DistributionWithDataFiles,
    name=package_name,
    version=manifest.findtext('version'),
    description=manifest.findtext('description'),
    license=manifest.findtext('license'),
    maintainer=maintainer.text,
    maintainer_email=maintainer.get('email'),
    packages=find_packages(include=[package_name, f'{package_name}.*']),
    package_data={f'{package_name}.evaluation': ['page.html']},
    python_requires='>=3.10',
    # Why these bounds: SECURITY.md.
    install_requires=['numba>=0.58,<1', 'numpy>=1.26,<3', 'opencv-python-headless>=4.6,<6',
                      'PyYAML>=5.4,<7', 'tqdm>=4.60,<5'],
    extras_require={
        'bags': ['rosbags>=0.11,<0.12'],
        'completion': ['argcomplete>=2,<4'],
        'cluster': ['distributed>=2024.1,<2028'],
        'evaluate': ['Jinja2>=3.0,<4', 'pandas>=2.1,<4', 'tabulate>=0.9,<1'],
        'pictures': ['matplotlib>=3.6,<4'],
        'ros': [
            'ros-jazzy-common-interfaces>=5.3,<6',
            'ros-jazzy-rclpy>=7.1,<8',
            'ros-jazzy-rmw-fastrtps-cpp>=8.4,<9',
        ],
        'test': ['hypothesis>=6.90,<7', 'psutil>=5.9,<8', 'pytest>=7.4,<9',
                 'pytest-timeout>=2.2,<3', 'scikit-image>=0.22,<1'],
        'video': ['av>=12,<19'],
    },
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'disparity_node = fuzzy_stereo_ros.node.disparity_node:main',
            'managed_disparity_node = fuzzy_stereo_ros.node.managed_node:main',
            'simulated_cameras = fuzzy_stereo_ros.node.simulated_cameras:main',
            'fuzzy-stereo = fuzzy_stereo_ros.commands.command_line:main',
        ],
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/config', sorted(glob('config/*'))),
        (f'share/{package_name}/launch', sorted(glob('launch/*.launch.*'))),
        # ROS looks for executables here, pip and colcon write the entry points to bin.
        (f'lib/{package_name}', ['resource/disparity_node', 'resource/managed_disparity_node',
                                 'resource/simulated_cameras']),
    ],
)
