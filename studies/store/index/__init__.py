"""What the files of a results folder say, kept beside them and made again whenever they change: never the truth."""
