from .notebook import explore as explore
from .session import Session as Session
from .surroundings import Surroundings as Surroundings
