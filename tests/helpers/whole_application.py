"""All commands in one application, for those who run them in this process."""

from identification.commands.application import whole

app = whole()
